"""Appearance of a pose of the disk in a picture."""
