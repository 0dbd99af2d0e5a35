"""Finding the disk and its marks in a frame."""
