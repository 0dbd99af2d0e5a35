"""Conversion from pixels to metres, with errors."""
