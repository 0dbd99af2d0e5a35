"""What is known of a film before it is measured: setup, scale, exposure, rolling shutter."""
