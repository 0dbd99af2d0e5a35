"""Limit on the number of pages of an address."""

from __future__ import annotations

from collections import Counter

from starlette.websockets import WebSocket

from .stream import Page


class Pages:
    """The open pages of each address.

    Parameters
    ----------
    most : int, optional
        How many one address may have open; without it any number.
    """

    def __init__(self, most: int | None) -> None:
        self._most = most
        self._open: Counter[str] = Counter()

    async def serve(self, socket: WebSocket, page: Page) -> None:
        """Answer a page until it is closed, or refuse it with a sentence."""
        address = socket.client.host if socket.client is not None else ""
        if self._most is not None and self._open[address] >= self._most:
            await socket.accept()
            words = f"{self._most} pages are open on this device, the most in a class: close one."
            await socket.send_json({"type": "error", "of": "page", "generation": None, "text": words})
            await socket.close(1013)
            return
        self._open[address] += 1
        try:
            await page.serve()
        finally:
            self._open[address] -= 1
            if not self._open[address]:
                del self._open[address]
