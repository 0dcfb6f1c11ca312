"""The library's commands, a file each; they parse, call and print, and own nothing else."""
