"""What compiled code runs on: threads, atomics, the compiler and its files on disk."""
