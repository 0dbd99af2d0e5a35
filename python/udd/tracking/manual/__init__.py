"""Setting up a film by clicks."""
