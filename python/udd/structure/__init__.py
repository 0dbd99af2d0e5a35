"""The bifurcation structure: equilibria, cycles, how they change with parameters."""
