"""How a pose of the disk looks in a picture."""
