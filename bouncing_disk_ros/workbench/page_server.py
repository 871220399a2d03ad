"""The web server of the page: where it listens, who may open a session, what it serves."""

from __future__ import annotations

import hmac
import logging
import os
import re
import secrets
import socket
from collections.abc import Callable, Sequence
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.document import Document
from bokeh.server.auth_provider import AuthProvider, NullAuth
from bokeh.server.server import Server
from tornado.web import HTTPError

from bouncing_disk_ros.errors import InputError

LOCAL = ("localhost", "127.0.0.1")
PATH = "/"
COOKIE = "bouncing_disk_workbench"
UNUSED_MS = 5000
"""A session that no page uses is dropped after this."""
_SETTINGS = ("BOKEH_ALLOW_WS_ORIGIN", "BOKEH_RESOURCES", "BOKEH_SIGN_SESSIONS", "BOKEH_CDN_VERSION")
"""Variables by which the environment could open the server or send the page elsewhere."""


def is_local(address: str) -> bool:
    """Whether an address is reached from this machine only."""
    return address in LOCAL


_ORIGIN = re.compile(r"[A-Za-z0-9._-]+(:[0-9]{1,5})?")


def checked_origins(given: Sequence[str]) -> list[str]:
    """Hosts, as host:port, or InputError: no wildcards."""
    for origin in given:
        if not _ORIGIN.fullmatch(origin):
            raise InputError("origins", origin, "host:port, such as bench.example.org:443")
    return [origin.lower() for origin in given]


class TokenAuth(AuthProvider):
    """Lets those in who have the token: in the address at first, in a cookie from then on."""

    def __init__(self, token: str) -> None:
        self._token = token
        super().__init__()

    @property
    def get_user(self) -> Callable[[Any], str]:
        """The check of a request: a name, or HTTP 403."""
        return self._user

    @property
    def login_url(self) -> str:
        """Not used: who is not let in gets HTTP 403."""
        return PATH

    @property
    def get_login_url(self) -> None:
        """None: see `login_url`."""
        return None

    @property
    def get_user_async(self) -> None:
        """None: `get_user` checks."""
        return None

    @property
    def login_handler(self) -> None:
        """None: there is no login page."""
        return None

    @property
    def logout_url(self) -> None:
        """None: there is no logout page."""
        return None

    @property
    def logout_handler(self) -> None:
        """None: there is no logout page."""
        return None

    def _user(self, handler: Any) -> str:
        given = handler.get_query_argument("token", "")
        cookie = handler.get_cookie(COOKIE) or ""
        if _same(given, self._token):
            handler.set_cookie(COOKIE, self._token, httponly=True, samesite="Strict")
        elif not _same(cookie, self._token):
            raise HTTPError(403, reason="the address lacks the token that workbench has printed")
        return "guest"


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


class PageServer:
    """Serves one page to any number of browsers.

    `address`: an interface of this machine; other than `LOCAL`, a token is needed. `port` 0: a free
    one. `origins`: further hosts, as host:port, whose pages may open a session (behind a proxy).
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
        for name in ("bokeh", "tornado.access"):  # of pages that were closed, of requests refused
            logging.getLogger(name).setLevel(logging.ERROR)
        self.token = "" if is_local(address) else secrets.token_urlsafe(24)
        self._address = address
        application = Application(FunctionHandler(make))
        try:
            port = free_port(address, port)
        except (OSError, OverflowError) as error:
            raise _cannot_listen(address, port, error) from None
        try:
            self.server = Server(
                {PATH: application},
                address=address,
                port=port,
                allow_websocket_origin=[*own_origins(address, port), *checked_origins(origins)],
                auth_provider=TokenAuth(self.token) if self.token else NullAuth(),
                unused_session_lifetime_milliseconds=UNUSED_MS,
                check_unused_sessions_milliseconds=UNUSED_MS,
                use_index=False,
            )
        except OSError as error:
            raise _cannot_listen(address, port, error) from None
        self.port = port
        self.server.start()

    @property
    def url(self) -> str:
        """The address of the page, with the token where one is needed."""
        host = "localhost" if is_local(self._address) else _host(self._address)
        token = f"?token={self.token}" if self.token else ""
        return f"http://{host}:{self.port}/{token}"

    @property
    def sessions(self) -> int:
        """Pages that are open."""
        return len(self.server.get_sessions(PATH))

    def close(self) -> None:
        """Stop listening and end the sessions."""
        self.server.stop()


def free_port(address: str, port: int) -> int:
    """The port, or any free one for 0. OSError where it is not free: Bokeh's says less."""
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


def own_origins(address: str, port: int) -> list[str]:
    """The hosts under which the server's own page is reached, as host:port."""
    hosts = {"localhost", "127.0.0.1"}
    if not is_local(address):
        hosts |= {_host(address), socket.gethostname(), socket.getfqdn(), *_addresses()}
    # Bokeh takes no addresses of IPv6 here: such a machine is reached by its name
    return sorted(f"{host.lower()}:{port}" for host in hosts if ":" not in host)


def _addresses() -> set[str]:
    """The addresses of this machine by its name."""
    try:
        found = socket.getaddrinfo(socket.gethostname(), None)
    except OSError:
        return set()
    return {str(address[4][0]) for address in found}


def _cannot_listen(address: str, port: int, error: Exception) -> InputError:
    reason = getattr(error, "strerror", "") or str(error)
    hint = f"{reason}. Take another: -p port:=0 finds a free one."
    return InputError(
        "port", port, f"a free port of an interface of this machine ({address})", hint
    )
