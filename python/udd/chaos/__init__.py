"""Lyapunov exponents, Poincare sections, recurrence and the lifetimes of transients."""
