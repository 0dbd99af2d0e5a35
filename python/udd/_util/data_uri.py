"""Files inside a page."""

from __future__ import annotations

import base64


def data_uri(kind: str, content: bytes) -> str:
    """Encode a file as a data URI of a media type, such as ``image/png``."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
