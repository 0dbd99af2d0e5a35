"""Validation on held-out data: forecasts, confirmation, and faults of sensor or camera."""
