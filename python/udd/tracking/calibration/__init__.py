"""What is known of a film before it is measured: config files, scale, exposure, rolling shutter, rim."""
