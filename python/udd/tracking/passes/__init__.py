"""The passes over a film's frames."""
