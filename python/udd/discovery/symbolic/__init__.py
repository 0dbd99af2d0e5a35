"""Short formulas for located curves."""
