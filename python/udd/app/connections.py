"""Limits on connections before any token was shown.

uvicorn limits the pause between two requests. It limits neither the time for the head of a request nor
the number of connections.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import math
import re
import socket
import sys
import time
from typing import Any

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from . import limits

_BUSY = b"HTTP/1.1 503 Service Unavailable\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"
_NO_MORE_FILES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_NUMBERS = re.compile(r"0x[0-9a-f]+|\d+")
_logger = logging.getLogger("uvicorn.error")


class Connection(H11Protocol):
    """A connection that is closed if it makes the server wait.

    The server waits for the head of a request to be complete, and for the visitor to read the answer. Each
    wait ends after `limits.PAUSE`, even if single bytes still arrive. If there are too many connections, the
    server closes those that have waited longest.
    """

    _deadline: asyncio.TimerHandle | None = None
    _since = 0.0
    _unread = False  # whether the answer fills its buffer

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Make room among the connections, or refuse this one."""
        super().connection_made(transport)
        for others, most in (
            (self.connections, max_connections()),
            (
                [other for other in self.connections if _address(other) == _address(self)],
                limits.CLIENT_CONNECTIONS,
            ),
        ):
            if len(others) > most and not _close_oldest(others, self):
                _logger.warning("udd app has as many connections as it takes; further ones are refused")
                transport.write(_BUSY)
                transport.close()
                return
        self._look()

    def data_received(self, data: bytes) -> None:
        """Read; a complete head ends the wait for it."""
        super().data_received(data)
        self._look()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        self._stop_waiting()
        super().on_response_complete()
        self._look()

    def pause_writing(self) -> None:
        """Wait for the visitor to read."""
        super().pause_writing()
        self._unread = True
        self._look()

    def resume_writing(self) -> None:
        """Go on with the answer."""
        super().resume_writing()
        self._unread = False
        self._look()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_waiting()
        super().connection_lost(exc)

    @property
    def waiting(self) -> bool:
        """Return True if the server waits for the visitor, and no WebSocket is open."""
        upgraded = self.transport.get_protocol() is not self
        return not upgraded and (self._unread or self.cycle is None or self.cycle.response_complete)

    def _look(self) -> None:
        if not self.waiting:
            self._stop_waiting()
        elif self._deadline is None:
            self._wait()

    def _wait(self) -> None:
        self._stop_waiting()
        self._since = self.loop.time()
        self._deadline = self.loop.call_later(limits.PAUSE, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


def _address(connection: Any) -> str | None:
    return connection.client[0] if connection.client else None


def _close_oldest(connections: Any, new: Connection) -> bool:
    """Close the connection that has waited longest; False if none waits."""
    waiting = [c for c in connections if isinstance(c, Connection) and c is not new and c.waiting]
    if not waiting:
        return False
    _logger.warning("udd app has as many connections as it takes; those without a request are closed")
    oldest = min(waiting, key=lambda c: c._since)
    oldest.connections.discard(oldest)
    oldest.transport.abort()
    return True


def max_connections() -> int:
    """Return the greatest number of connections: each is a file, of which the system has a limited number."""
    return min(limits.CONNECTIONS, max(8, (_files() - limits.BACKLOG) // 2))


def _files() -> int:
    if sys.platform == "win32":
        return 1 << 13
    import resource

    return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


def raise_file_limit() -> None:
    """Take as many open files as the connections need, if the system gives them."""
    if sys.platform == "win32":
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 4 * limits.CONNECTIONS
    if hard != resource.RLIM_INFINITY:
        wanted = min(wanted, hard)
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


class OncePerMinute(logging.Filter):
    """Lets a message pass once a minute: what a visitor can cause must not fill a disk."""

    def __init__(self) -> None:
        super().__init__()
        self._last: dict[str, float] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True if the message, apart from its numbers, was not logged within the last minute."""
        message = _NUMBERS.sub("", f"{record.name} {record.msg}"[:300])
        now = time.monotonic()
        if now - self._last.get(message, now - 60.0) < 60.0:
            return False
        if len(self._last) > 1000:
            self._last.clear()
        self._last[message] = now
        return True


class _Server(uvicorn.Server):
    """A server whose loop frees files where there are no more, and logs each complaint once a minute."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        asyncio.get_running_loop().set_exception_handler(self._complain)
        for name in ("asyncio", "uvicorn.error"):
            logging.getLogger(name).addFilter(OncePerMinute())
        await super().startup(sockets)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        level = _logger.level
        _logger.setLevel(logging.CRITICAL)  # that requests are cut off is meant
        try:
            await super().shutdown(sockets)
        finally:
            _logger.setLevel(level)

    def _complain(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if not (isinstance(error, OSError) and error.errno in _NO_MORE_FILES):
            loop.default_exception_handler(context)
            return
        _logger.warning("udd app cannot take a connection: %s", error.strerror)
        for connection in list(self.server_state.connections):  # asyncio tries again after a second
            if isinstance(connection, Connection) and connection.waiting:
                connection.transport.abort()


def server_of(app: ASGIApp) -> uvicorn.Server:
    """Return the server of an application, with limits for data from the network."""
    config = uvicorn.Config(
        app,
        http=Connection,
        log_level="warning",
        access_log=False,
        backlog=limits.BACKLOG,
        timeout_keep_alive=math.ceil(limits.PAUSE),
        ws_max_size=limits.MESSAGE,
        ws_ping_interval=limits.PAUSE,
        ws_ping_timeout=limits.PAUSE,
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    return _Server(config)
