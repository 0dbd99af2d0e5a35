"""From pixels to metres, with errors."""
