"""Helpers of all packages: checks, files, progress, threads."""
