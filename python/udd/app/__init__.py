"""The page: `udd app` serves it on this machine. A surface: it holds no physics and no statistics."""
