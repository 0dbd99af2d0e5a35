"""Effects of unknown form: penalised splines of the state."""
