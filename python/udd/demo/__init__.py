"""The sample films that ship with the package."""
