"""The server of the page, and the loop that serves it until a signal."""

from __future__ import annotations

import asyncio
import errno
import importlib
import os
import re
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping, Sequence

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.server import BaseServer
from tornado.ioloop import IOLoop, PeriodicCallback
from tornado.netutil import bind_sockets

from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value, items_of
from bouncing_disk_ros.workbench.page import Pages
from bouncing_disk_ros.workbench.page_guard import (
    COOKIE,
    LIMITS,
    MESSAGE_BYTES,
    BoundedLog,
    BoundedServer,
    GuardedApplication,
)
from bouncing_disk_ros.workbench.run_link import RunLink

LOCAL = ("localhost", "127.0.0.1")
PATH = "/"
UNUSED_MS = 5000
"""A session that no page uses is dropped after this."""
_SETTINGS = ("BOKEH_ALLOW_WS_ORIGIN", "BOKEH_RESOURCES", "BOKEH_SIGN_SESSIONS", "BOKEH_CDN_VERSION")
"""Variables by which the environment could open the server or send the page elsewhere."""


def is_local(address: str) -> bool:
    """Whether an address is reached from this machine only."""
    return address in LOCAL


_USUAL = re.compile(r":(80|443)$")
_ORIGIN = re.compile(r"[A-Za-z0-9._-]+(:[0-9]{1,5})?")


def checked_origins(given: Sequence[str]) -> list[str]:
    """Hosts, as host:port, or InputError: no wildcards."""
    for origin in given:
        if not _ORIGIN.fullmatch(origin):
            raise InputError("origins", origin, "host:port, such as bench.example.org:443")
    plain = [origin.lower() for origin in given]
    # a browser leaves out the port that its protocol has of itself
    return [*plain, *(origin.rpartition(":")[0] for origin in plain if _USUAL.search(origin))]


class PageServer:
    """Serves one page to any number of browsers.

    `address`: an interface of this machine. `port` 0: a free one. `origins`: further hosts, as
    host:port, under which the page is reached (behind a proxy). Whoever has no token is refused.
    InputError: the port is in use, or the address is none of this machine.
    """

    def __init__(
        self,
        make: Callable[[Document], object],
        address: str,
        port: int,
        origins: Sequence[str] = (),
    ) -> None:
        for name in _SETTINGS:
            os.environ.pop(name, None)
        BoundedLog().install()
        self.token = secrets.token_urlsafe(24)
        self._address = address
        further = checked_origins(origins)
        try:
            port = free_port(address, port)
            sockets = bind_sockets(port, address)
        except (OSError, OverflowError) as error:
            raise _cannot_listen(address, port, error) from None
        self.port = port
        hosts = [*own_hosts(address, port), *further]
        self.application = GuardedApplication(
            {PATH: Application(FunctionHandler(make))},
            hosts=hosts, token=self.token, cookie=f"{COOKIE}_{port}",
            extra_websocket_origins=[host for host in hosts if not host.startswith("[")],
            websocket_max_message_size_bytes=MESSAGE_BYTES,
            unused_session_lifetime_milliseconds=UNUSED_MS,
            check_unused_sessions_milliseconds=UNUSED_MS,
            use_index=False,
        )  # fmt: skip
        http = BoundedServer(self.application, **LIMITS)
        http.add_sockets(sockets)
        self.server = BaseServer(IOLoop.current(), self.application, http)
        self.server.start()

    @property
    def url(self) -> str:
        """The address of the page, with the token."""
        host = "localhost" if is_local(self._address) else _host(self._address)
        return f"http://{host}:{self.port}/?token={self.token}"

    def close(self) -> None:
        """Stop listening and end the sessions."""
        self.server.stop()


def free_port(address: str, port: int) -> int:
    """The port, or any free one for 0. OSError where it is not: then Tornado's leaves a socket."""
    family, kind, _, _, place = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family, kind) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(place)
        return int(probe.getsockname()[1])


def _host(address: str) -> str:
    """What others call an address: the machine's name where it stands for all interfaces."""
    if address in ("0.0.0.0", "::", ""):  # noqa: S104 (it is compared with, not bound to)
        return socket.gethostname()
    return f"[{address}]" if ":" in address else address


def own_hosts(address: str, port: int) -> list[str]:
    """The hosts under which the server's own page is reached, as host:port."""
    hosts = {"localhost", "127.0.0.1", "::1"}
    if not is_local(address):
        hosts |= {_host(address), address, socket.gethostname(), socket.getfqdn(), *_addresses()}
    named = {f"[{host}]" if ":" in host and not host.startswith("[") else host for host in hosts}
    return sorted(f"{host.lower()}:{port}" for host in named if host)


def _addresses() -> set[str]:
    """The addresses of this machine by its name."""
    try:
        found = socket.getaddrinfo(socket.gethostname(), None)
    except OSError:
        return set()
    return {str(address[4][0]) for address in found}


def _cannot_listen(address: str, port: int, error: Exception) -> InputError:
    reason = getattr(error, "strerror", "") or str(error)
    if isinstance(error, socket.gaierror) or getattr(error, "errno", 0) == errno.EADDRNOTAVAIL:
        allowed = "localhost, 0.0.0.0 for all, or an address of an interface of this machine"
        return InputError("address", address, allowed, f"{reason}.")
    hint = f"{reason}. Take another: -p port:=0 finds a free one."
    return InputError("port", port, f"a free port of {address}", hint)


# ------------------------------------------------------------------------------------------------
# The loop that serves the page until a signal, whatever run is behind it.


LOOK_MS = 200
"""So often a signal is looked for, and the link."""


def _load_maps() -> None:
    """Load what maps are computed with: some seconds, which the first look would take."""
    importlib.import_module("bouncing_disk_ros.workbench.basin_pane")
    importlib.import_module("bouncing_disk_ros.workbench.bifurcation_pane")


def serve(
    values: Mapping[str, Value],
    link: RunLink,
    stop: Stop,
    look_after: Callable[[], object] = lambda: None,
) -> int:
    """Serve pages on a link until a signal; the exit code. InputError: it cannot listen there.

    `look_after` is called a few times a second.
    """
    asyncio.set_event_loop(asyncio.new_event_loop())
    loop = IOLoop.current()
    address = str(values["address"])
    pages = Pages(link)
    server = PageServer(
        pages.make, address, int(values["port"]),
        items_of(str(values["origins"])),
    )  # fmt: skip
    print(f"workbench: {link.source}: {server.url}", flush=True)
    if not is_local(address):
        print(
            f"workbench: warning: everybody who can reach {address} and knows this address, with "
            "its token, can command the run; the connection is not encrypted",
            file=sys.stderr,
            flush=True,
        )
    if values["open_browser"] and has_display():
        webbrowser.open(server.url)

    def look() -> None:
        link.tick()
        look_after()
        if stop.asked:
            loop.stop()

    load = threading.Thread(target=_load_maps, name="workbench maps", daemon=True)
    load.start()  # meanwhile the first page is there
    look_again = PeriodicCallback(look, LOOK_MS)
    look_again.start()
    try:
        loop.start()
    finally:
        look_again.stop()
        server.close()
    return 0


def has_display() -> bool:
    """Whether a browser can be opened."""
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
