"""What every package uses and none of them owns: checks, files, progress, threads."""
