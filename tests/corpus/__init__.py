"""A corpus of real houses: files that other people have published, and what the program makes of them.

The files are not part of the project. ``manifest.toml`` says where each of them is; ``python -m tests.corpus FOLDER``
builds those that lie in FOLDER and reports what came of them. docs/contributing/corpus.md tells how to use it.
"""
