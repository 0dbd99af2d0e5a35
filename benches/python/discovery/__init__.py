"""How well undeclared effects are found in simulated records; see __main__."""
