"""Lyapunov exponents and spectra, Poincare sections and recurrence."""
