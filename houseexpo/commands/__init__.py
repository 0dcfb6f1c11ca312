"""The library's commands, one file each; they parse arguments, call the library and print the result."""
