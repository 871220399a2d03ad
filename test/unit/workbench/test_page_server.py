"""The server of the page: who may open a session, what is served, ports."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import time
from collections.abc import Callable, Coroutine, Iterator
from typing import Any
from urllib.parse import urljoin, urlsplit

import psutil
import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest, HTTPResponse
from tornado.websocket import WebSocketClosedError, websocket_connect

from bouncing_disk_ros.workbench import page_guard
from bouncing_disk_ros.workbench.page import Pages
from bouncing_disk_ros.workbench.page_guard import COOKIE
from bouncing_disk_ros.workbench.page_server import PageServer
from support.bokeh_page import ListLink
from support.checks import refused
from support.page_client import cookie_of, token_of

Run = Callable[[Coroutine[Any, Any, Any]], Any]
Serve = Callable[..., PageServer]
ALL = "0.0.0.0"


@pytest.fixture
def run() -> Iterator[Run]:
    """Run a coroutine in the loop of the servers that the test makes."""
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    yield lambda work: loop.run_until_complete(asyncio.wait_for(work, 60.0))
    loop.run_until_complete(loop.shutdown_asyncgens())
    AsyncHTTPClient().close()
    loop.close()
    asyncio.set_event_loop(None)


@pytest.fixture
def pages() -> Pages:
    return Pages(ListLink())


@pytest.fixture
def serve(run: Run) -> Iterator[Serve]:
    """Makes servers; of an empty page where none is given, for the real one takes a second."""
    made: list[PageServer] = []

    def make(
        address: str = "localhost", port: int = 0, page: Any = lambda _: None, **options: Any
    ) -> PageServer:
        made.append(PageServer(page, address, port, **options))
        return made[-1]

    yield make
    for server in made:
        server.close()


async def get(url: str, **options: Any) -> HTTPResponse:
    return await AsyncHTTPClient().fetch(HTTPRequest(url, request_timeout=30.0, **options))


def status(run: Run, url: str, **options: Any) -> int:
    try:
        return int(run(get(url, **options)).code)
    except HTTPClientError as error:
        return int(error.code)
    except ValueError:  # a request that this client does not send
        return 400


def visit(run: Run, server: PageServer) -> tuple[str, str]:
    """Open the page: the token of its session, and its cookie."""
    page = run(get(server.url))
    return token_of(page.body), cookie_of(page)


async def connect(
    server: PageServer, token: str, cookie: str = "", origin: str | None = None, **more: str
) -> Any:
    """Open a websocket as a page does; its connection."""
    headers = {"Origin": origin or f"http://127.0.0.1:{server.port}", "Cookie": cookie, **more}
    request = HTTPRequest(f"ws://127.0.0.1:{server.port}/ws", headers=headers)
    return await websocket_connect(request, subprotocols=["bokeh", token])


async def open_session(
    server: PageServer, token: str, cookie: str = "", origin: str | None = None, **more: str
) -> Any:
    """The first message of a websocket, None where it is closed instead."""
    connection = await connect(server, token, cookie, origin, **more)
    first = await connection.read_message()
    connection.close()
    return None if first is None else json.loads(first)


def test_the_page_is_served_to_several_browsers(run: Run, serve: Serve, pages: Pages) -> None:
    server = serve(page=pages.make)
    assert server.url == f"http://localhost:{server.port}/?token={server.token}"
    visits = [visit(run, server) for _ in range(2)]
    assert len(pages.open) == 2
    assert len({token for token, _ in visits}) == 2
    for token, cookie in visits:
        first = run(open_session(server, token, cookie, f"http://localhost:{server.port}"))
        assert first["msgtype"] == "ACK"


def test_the_page_brings_all_it_needs_from_its_own_server(
    run: Run, serve: Serve, pages: Pages, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the environment asks Bokeh for another place, or for open doors."""
    monkeypatch.setenv("BOKEH_RESOURCES", "cdn")
    monkeypatch.setenv("BOKEH_ALLOW_WS_ORIGIN", "*")
    server = serve(page=pages.make)
    page = run(get(server.url))
    body = page.body.decode()
    sources = re.findall(r'(?:src|href)="([^"]+)"', body)
    assert sources
    assert {urlsplit(source).netloc for source in sources} <= {"", f"localhost:{server.port}"}
    for source in sources:
        whole = urljoin(f"http://localhost:{server.port}/", source)
        assert status(run, whole) == 403, "without the token"
        assert status(run, whole, headers={"Cookie": cookie_of(page)}) == 200
    token = token_of(page.body)
    with pytest.raises(HTTPClientError, match="403"):
        run(open_session(server, token, cookie_of(page), "http://elsewhere.example"))


def test_nobody_else_can_connect(serve: Serve) -> None:
    """All that listens at its port does so on addresses of this machine alone."""
    port = serve().port
    listening = [one.laddr for one in psutil.Process().net_connections() if one.status == "LISTEN"]
    hosts = {str(place.ip) for place in listening if place.port == port}
    assert hosts
    assert hosts <= {"127.0.0.1", "::1"}


def test_a_page_from_elsewhere_opens_no_session(run: Run, serve: Serve) -> None:
    server = serve()
    token, cookie = visit(run, server)
    others = ("elsewhere.example", "localhost:1", "127.0.0.1.example", f"x.localhost:{server.port}")
    for origin in ("null", *(f"http://{other}" for other in others)):
        with pytest.raises(HTTPClientError, match="403"):
            run(open_session(server, token, cookie, origin))
    assert run(open_session(server, "made-up", cookie)) is None


def test_a_name_that_was_pointed_here_gets_nothing(run: Run, serve: Serve) -> None:
    """DNS rebinding: the page of a foreign name, whose requests come to this server."""
    server = serve()
    token, cookie = visit(run, server)
    name = f"elsewhere.example:{server.port}"
    for host in (name, "elsewhere.example", "", f"localhost:{server.port}.example", "localhost"):
        for path in ("/", f"/?token={server.token}", "/static/js/bokeh.min.js", "/favicon.ico"):
            url = f"http://127.0.0.1:{server.port}{path}"
            given = {"Host": host, "Cookie": cookie}
            assert status(run, url, headers=given) in (400, 403), (host, path)
        with pytest.raises(HTTPClientError, match=r"40[03]"):
            run(open_session(server, token, cookie, f"http://{host}", Host=host))


def test_no_file_is_served_but_its_own(run: Run, serve: Serve) -> None:
    server = serve()
    base = f"http://localhost:{server.port}"
    own = ("/etc/passwd", "/static/../../etc/passwd", "/static/%2e%2e/%2e%2e/x", "/..%2fx")
    for path in (*own, "/autoload.js", "/metadata", "/static/"):
        assert status(run, f"{base}{path}?token={server.token}") in (403, 404), path


@pytest.mark.parametrize("address", ["localhost", ALL])
def test_each_request_needs_the_token(run: Run, serve: Serve, address: str) -> None:
    server = serve(address)
    local = f"http://127.0.0.1:{server.port}/"
    assert server.token in server.url
    assert len(server.token) >= 32
    for given in ("", f"?token={server.token[:-1]}", "?token=%ff%fe", "?token="):
        assert status(run, local + given) == 403
    page = run(get(f"{local}?token={server.token}"))
    assert page.code == 200
    cookie = cookie_of(page)
    assert cookie == f"{COOKIE}_{server.port}={server.token}"
    assert "HttpOnly" in page.headers["Set-Cookie"]
    assert "SameSite=Strict" in page.headers["Set-Cookie"]
    assert page.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
    assert page.headers["Referrer-Policy"] == "no-referrer"
    token = token_of(page.body)
    assert run(open_session(server, token, cookie))["msgtype"] == "ACK"
    for wrong in ("", cookie[:-1], f"{COOKIE}_{server.port}=\xff"):
        with pytest.raises(HTTPClientError, match="403"):
            run(open_session(server, token, wrong))
    with pytest.raises(HTTPClientError, match="403"):
        run(open_session(server, token, cookie, "http://elsewhere.example"))


def test_pages_and_connections_are_bounded(
    run: Run, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_guard, "MOST_PAGES", 3)
    monkeypatch.setattr(page_guard, "MOST_CONNECTIONS", 8)
    server = serve()
    visits = [visit(run, server) for _ in range(3)]
    assert status(run, server.url) == 503
    assert status(run, server.url, headers={"Cookie": visits[0][1]}) == 503

    async def open_many() -> None:
        token, cookie = visits[0]
        opened = [await connect(server, token, cookie) for _ in range(3)]
        with pytest.raises(HTTPClientError, match="503"):
            await connect(server, token, cookie)
        opened.pop().close()
        while len(server.application.sockets) > 2:
            await asyncio.sleep(0.01)
        opened.append(await connect(server, token, cookie))
        idle = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(12)]
        closed = [await asyncio.wait_for(reader.read(1), 30.0) for reader, _ in idle[8:]]
        assert closed == [b""] * 4
        for one in opened:
            one.close()
        for _, writer in idle:
            writer.close()

    run(open_many())


PATCH = '{"msgid": "1", "msgtype": "PATCH-DOC"}'
CHANGED = '{"events": [{"kind": "ModelChanged", "model": {"id": "SECRET"}, "attr": "a", "new": 1}]}'
JUNK: dict[str, list[str | bytes]] = {
    "no JSON": ["{"],
    "binary": [b"\x00\xff" * 1000],
    "no header": ["{}", "{}", "{}"],
    "a list": ["[]", "[]", "[]"],
    "deep": ["[" * 200_000],
    "long": ["x" * (page_guard.MESSAGE_BYTES + 1)],
    "unknown": ['{"msgid": "1", "msgtype": "SECRET"}', "{}", "{}"],
    "odd patch": [PATCH, "{}", '{"events": [{"kind": "SECRET"}]}'],
    "no model": [PATCH, "{}", CHANGED],
    "buffers": [PATCH.replace("}", ', "num_buffers": 1000000000}'), "{}", "{}"],
}


def test_junk_ends_its_socket_and_is_not_in_the_log(
    run: Run, serve: Serve, capfd: pytest.CaptureFixture[str]
) -> None:
    """The same again and again on one socket: a line a second, which holds nothing of it."""
    server = serve()
    token, cookie = visit(run, server)

    async def flood(fragments: list[str | bytes]) -> None:
        socket = await connect(server, token, cookie)
        await socket.read_message()
        with contextlib.suppress(WebSocketClosedError):
            for fragment in fragments * 30:
                await socket.write_message(fragment, binary=isinstance(fragment, bytes))
        socket.close()
        while server.application.sockets:
            await asyncio.sleep(0.01)

    begin = time.monotonic()
    for fragments in JUNK.values():
        run(flood(fragments))
    lines = capfd.readouterr().err.splitlines()
    assert 1 <= len(lines) <= 2 + time.monotonic() - begin
    assert max(map(len, lines)) < 200
    assert "SECRET" not in "".join(lines)
    assert run(open_session(server, token, cookie))["msgtype"] == "ACK"


def test_a_page_is_heard_at_a_bounded_rate(
    run: Run, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_guard, "BURST", 20.0)
    monkeypatch.setattr(page_guard, "FRAGMENTS_PER_SECOND", 100.0)
    server = serve()
    token, cookie = visit(run, server)
    wanted = 20  # questions of three fragments: 40 of 60 wait for a hundredth of a second each

    async def ask() -> float:
        socket = await connect(server, token, cookie)
        await socket.read_message()
        begin = time.monotonic()
        for number in range(wanted):
            for fragment in (f'{{"msgid": "{number}", "msgtype": "SERVER-INFO-REQ"}}', "{}", "{}"):
                await socket.write_message(fragment)
        answers = 0
        while answers < wanted:
            answers += b"SERVER-INFO-REPLY" in (await socket.read_message()).encode()
        socket.close()
        return time.monotonic() - begin

    assert run(ask()) > 0.35


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"address": "192.0.2.1"}, r"192\.0\.2\.1"),
        *(({"origins": [one]}, "host:port")
          for one in ("*", "http://a.example", "a b", "", "host:notaport")),
    ],
)  # fmt: skip
def test_an_address_of_another_machine_and_other_origins_than_hosts_are_refused(
    serve: Serve, given: dict[str, Any], line: str
) -> None:
    refused(line, serve, **given)


def test_a_proxy_may_be_allowed(run: Run, serve: Serve) -> None:
    server = serve(origins=["Bench.Example:443"])
    token, cookie = visit(run, server)
    for host in ("bench.example", "bench.example:443"):
        first = run(open_session(server, token, cookie, "https://bench.example:443", Host=host))
        assert first["msgtype"] == "ACK"
