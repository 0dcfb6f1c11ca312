"""Runs as files: CARMEN logs, films."""
