"""Where marks and tags sit on the disk."""
