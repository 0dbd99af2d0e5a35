"""Start of the server by the command."""

from __future__ import annotations

import ipaddress
import socket
import sys
import webbrowser
from collections.abc import Callable

from udd.errors import UddError


def serve(
    host: str,
    port: int,
    *,
    fragment: str = "",
    browser: bool = True,
    ready: Callable[[str], object] = print,
    classroom: bool = False,
) -> None:
    """Serve the page until Ctrl-C.

    Parameters
    ----------
    host, port : str, int
        Address and port; port 0 is any free one.
    fragment : str
        The run to open with: the part of a link after #.
    browser : bool
        If True, open a browser.
    ready : callable
        Called with the link once the server listens.
    classroom : bool
        If True, the page only simulates: no files, no films, a few pages for each address.

    Raises
    ------
    UddError
        The address cannot be used.
    """
    from .connections import raise_file_limit, server_of
    from .server import make_app, new_token

    listening = _listen(host, port)
    port = listening.getsockname()[1]
    names, any_address = hosts_of(host, port)
    if not _is_local(host):
        print(
            "udd: warning: everybody on this network who is given the link can use this page, and what "
            "passes is not encrypted",
            file=sys.stderr,
        )
    token = new_token()
    shown = names[0] if not any_address else f"{network_address() or _own_name()}:{port}"
    link = f"http://{shown}/?token={token}"
    server = server_of(make_app(token, names, any_address=any_address, prepared=True, classroom=classroom))
    raise_file_limit()
    ready(link)
    if browser:
        webbrowser.open(link + (f"#{fragment}" if fragment else ""))
    server.run(sockets=[listening])


def hosts_of(host: str, port: int) -> tuple[list[str], bool]:
    """Return the names that a browser may use for this server, and whether it may use any address."""
    bracketed = f"[{host}]" if ":" in host else host
    any_address = host in ("0.0.0.0", "::")
    if any_address:
        names = ["127.0.0.1", "localhost", _own_name(), f"{_own_name().removesuffix('.local')}.local"]
        return [f"{name}:{port}" for name in dict.fromkeys(names)], True
    names = [f"{bracketed}:{port}"]
    if _is_local(host):
        names += [f"localhost:{port}"]
    return names, False


def network_address() -> str | None:
    """Return the address by which others on the network reach this machine, if it has one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # nothing is sent: the system only chooses an interface
            address = str(probe.getsockname()[0])
        except OSError:
            return None
    return None if ipaddress.ip_address(address).is_loopback else address


def _own_name() -> str:
    return socket.gethostname().lower()


def _is_local(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _listen(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except UnicodeError:
        raise UddError(f"{host} is no name of a machine") from None
    except OSError as error:
        raise UddError(f"{host}:{port} cannot be served: {error.strerror or error}") from None
    listening = socket.socket(family, kind, protocol)
    try:
        if sys.platform != "win32":
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(64)
    except OSError as error:
        listening.close()
        raise UddError(f"{host}:{port} cannot be served: {error.strerror or error}") from None
    return listening
