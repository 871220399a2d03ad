"""What stands before the page's web server: hosts, the token, limits of sockets, a short log.

Every request is checked before Bokeh sees it. A page of another site that gets its name to point to
this machine (DNS rebinding) sends its own name as Host, and has no token. Bokeh's own hook
(`auth_module`) does not cover static files, and Tornado's (`prepare`) is one for each handler.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import sys
import time
import traceback
from collections.abc import Collection
from functools import partial
from pathlib import Path
from typing import Any

from bokeh.server.tornado import BokehTornado
from bokeh.server.views.ws import WSHandler
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.web import OutputTransform, RequestHandler

from bouncing_disk_ros.run.throttled_log import ThrottledLog

COOKIE = "bouncing_disk_workbench"
PATHS = ("/", "/ws", "/favicon.ico")
STATIC = "/static/"
MOST_CONNECTIONS = 200
MOST_PAGES = 32
"""Pages that are open, or were opened in the last seconds."""
MESSAGE_BYTES = 1 << 18
"""Most bytes of a message of a page; a page sends some kilobytes at most."""
FRAGMENTS_PER_SECOND, BURST = 2000.0, 4000.0
"""A page that is zoomed sends some 900 fragments a second: five messages of three, 60 times."""
LIMITS = {
    "max_buffer_size": 1 << 20, "max_header_size": 1 << 14, "max_body_size": 1 << 14,
    "idle_connection_timeout": 20.0, "body_timeout": 10.0,
}  # fmt: skip
"""Of each connection, in bytes and s; before a websocket is opened on it."""
HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
"""Of each answer: no other page shows this one in a frame, or learns its address."""


class BoundedServer(HTTPServer):
    """An HTTP server with so many connections at most."""

    def handle_stream(self, stream: Any, address: Any) -> None:
        """Take a connection, or close it."""
        if len(self._connections) >= MOST_CONNECTIONS:
            stream.close()
        else:
            super().handle_stream(stream, address)


class GuardedApplication(BokehTornado):
    """Bokeh's application for those who name a host of ours and have the token.

    `hosts`: what may stand as Host, as host:port. `cookie`: the name of the cookie that brings the
    token once it was in an address.
    """

    def __init__(
        self, *args: Any, hosts: Collection[str], token: str, cookie: str, **options: Any
    ) -> None:
        super().__init__(*args, **options)
        self.sockets: set[PageSocket] = set()  # those that are open
        self.token, self.cookie = token, cookie
        self._hosts = frozenset(hosts)
        self.transforms = [partial(_Headers, self)]
        for rule in self.wildcard_router.rules:
            if rule.target is WSHandler:
                rule.target = PageSocket

    def find_handler(self, request: HTTPServerRequest, **options: Any) -> Any:
        """Bokeh's handler of a request, or a refusal."""
        if refusal := self._refusal(request):
            status, why = refusal
            return self.get_handler_delegate(request, Refused, {"status": status, "why": why})
        return super().find_handler(request, **options)

    def _refusal(self, request: HTTPServerRequest) -> tuple[int, str] | None:
        """The status and the reason of a refusal, None for none."""
        if request.host.lower() not in self._hosts:
            return 403, "this host is not served here: -p origins:=HOST:PORT allows it"
        cookie = request.cookies.get(self.cookie)
        knows = cookie is not None and self._is_token(cookie.value.encode("utf-8", "replace"))
        if not knows and not self.brings_token(request):
            return 403, "the address lacks the token that workbench has printed"
        if request.path not in PATHS and not request.path.startswith(STATIC):
            return 404, "there is no such page"
        if request.path == "/" and len(self.get_sessions("/")) >= MOST_PAGES:
            return 503, f"{MOST_PAGES} pages are open: close some"
        if request.path == "/ws" and len(self.sockets) >= MOST_PAGES:
            return 503, f"{MOST_PAGES} pages are open: close some"
        return None

    def brings_token(self, request: HTTPServerRequest) -> bool:
        """Whether the address of a request holds the token."""
        return self._is_token(request.query_arguments.get("token", [b""])[-1])

    def _is_token(self, given: bytes) -> bool:
        return hmac.compare_digest(given, self.token.encode())


class Refused(RequestHandler):
    """Answers a request with a status and a reason, whatever its method."""

    def initialize(self, status: int, why: str) -> None:
        """Take both."""
        self._status, self._why = status, why

    def prepare(self) -> None:
        """Answer."""
        self.set_status(self._status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.set_header("Connection", "close")
        self.finish(f"{self._why}\n")


class _Headers(OutputTransform):
    """Adds `HEADERS` to each answer, and the cookie where the address held the token."""

    def __init__(self, application: GuardedApplication, request: HTTPServerRequest) -> None:
        self._application, self._request = application, request

    def transform_first_chunk(
        self,
        status_code: int,
        headers: HTTPHeaders,
        chunk: bytes,
        finishing: bool,  # noqa: ARG002
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Add them."""
        for name, value in HEADERS.items():
            headers[name] = value
        application = self._application
        if status_code == 200 and application.brings_token(self._request):
            given = f"{application.cookie}={application.token}; HttpOnly; Path=/; SameSite=Strict"
            headers.add("Set-Cookie", given)
        return status_code, headers, chunk


class PageSocket(WSHandler):
    """The websocket of a page, which sends no faster than `FRAGMENTS_PER_SECOND`.

    What comes faster waits in the sender's network; a socket that was closed is not heard.
    """

    def open(self) -> None:
        """Count it, and let Bokeh open it."""
        self.application.sockets.add(self)
        self._room, self._last = BURST, time.monotonic()
        super().open()

    async def on_message(self, fragment: str | bytes) -> None:
        """Hand a fragment to Bokeh in its time."""
        now = time.monotonic()
        self._room = min(BURST, self._room + (now - self._last) * FRAGMENTS_PER_SECOND) - 1.0
        self._last = now
        if self._room < 0.0:
            await asyncio.sleep(-self._room / FRAGMENTS_PER_SECOND)
        if self.ws_connection is not None:
            await super().on_message(fragment)

    def close(self, code: int | None = None, reason: str | None = None) -> None:
        """Close it; Bokeh's own codes are none of the standard."""
        super().close(1002 if code and code >= 5000 else code, (reason or "")[:100] or None)

    def on_close(self) -> None:
        """Count it no longer."""
        self.application.sockets.discard(self)
        super().on_close()


class BoundedLog(logging.Handler):
    """Errors of Bokeh and Tornado, a line a second: what failed where, none of what was sent."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self._log = ThrottledLog(partial(print, "workbench:", file=sys.stderr, flush=True))

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line, or count it."""
        self._log.note("error", partial(_what, record))

    def install(self) -> None:
        """Take the place of all that these two libraries log to."""
        for name in ("bokeh", "tornado"):
            logger = logging.getLogger(name)
            logger.handlers, logger.propagate = [self], False
            logger.setLevel(logging.ERROR)
        logging.getLogger("tornado.access").setLevel(logging.ERROR)


def _what(record: logging.LogRecord) -> str:
    """Where an error is from: its kind and line of code, else the text that all its like have."""
    error = record.exc_info[1] if record.exc_info else None
    if error is None:
        return str(record.msg).split("%")[0].split("\n")[0].strip()
    frames = traceback.extract_tb(error.__traceback__)
    place = f" at {Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""
    return f"{type(error).__name__}{place}"
