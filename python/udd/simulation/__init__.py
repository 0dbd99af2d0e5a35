"""Trajectories: one run, many runs, and the balance of its energy."""
