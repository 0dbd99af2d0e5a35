"""Access control: only pages of this server, and only with the token."""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Iterable
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

OPEN = ("/static/",)
"""Paths without a token: files that ship with the package."""

_POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'self'"
)
#: A report holds its style and pictures in itself, no script, and reaches nothing.
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; media-src data:; "
    "frame-ancestors 'self'; sandbox"
)


class Guard:
    """Refuses requests with a foreign Host or Origin or without the token; sets the headers of all answers.

    A foreign Host is a name that somebody else resolves to this machine (DNS rebinding), a foreign Origin a
    page of somebody else's in the same browser.
    """

    def __init__(self, app: ASGIApp, token: str, hosts: Iterable[str], *, any_address: bool = False) -> None:
        self.app = app
        self._token = token.encode()
        self._hosts = {host.lower() for host in hosts}
        self._any_address = any_address

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through or not."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        refusal = self.refusal(scope)
        if refusal is None:
            await self.app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": refusal})
        else:
            await PlainTextResponse(refusal, 403)(scope, receive, _with_headers(send))

    def refusal(self, scope: Scope) -> str | None:
        """Return the reason for refusing a request, in a sentence; None if it is accepted."""
        headers = Headers(scope=scope)
        hosts = headers.getlist("host")
        if len(hosts) != 1 or not self._is_own_host(hosts[0]):
            return "This server answers only to the address that udd app printed."
        origin = headers.get("origin")
        if origin is None:
            # Browsers always send it where another page could speak in this one's name.
            if scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD"):
                return "The request does not say which page it comes from."
        elif origin != f"http://{hosts[0]}":
            return "The request comes from another page."
        if scope["type"] == "http" and scope["path"].startswith(OPEN):
            return None
        asked = parse_qs(scope["query_string"].decode("latin-1"))
        token = headers.get("x-udd-token") or asked.get("token", [""])[0]
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self._token):
            return "The token is missing or wrong: open the link that udd app printed."
        return None

    def _is_own_host(self, host: str) -> bool:
        if host.lower() in self._hosts:
            return True
        if not self._any_address:
            return False
        name = host.rpartition(":")[0].strip("[]")
        try:
            ipaddress.ip_address(name)  # an address cannot be rebound
        except ValueError:
            return False
        return True


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("content-security-policy", _POLICY)
            headers["x-content-type-options"] = "nosniff"
            headers["referrer-policy"] = "no-referrer"
            headers["cross-origin-opener-policy"] = "same-origin"
            headers["cross-origin-resource-policy"] = "same-origin"
            headers["cache-control"] = "no-store"
        await send(message)

    return sending
