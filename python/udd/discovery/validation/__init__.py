"""Held-out data decide: forecasts, confirmation, and what a sensor or a camera would do."""
