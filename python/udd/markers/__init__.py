"""Places of marks and tags on the disk."""
