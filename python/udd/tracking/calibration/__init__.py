"""Calibration of a film before the measurement: config files, scale, exposure, rolling shutter, rim."""
