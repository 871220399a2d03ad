"""The server of the page: who may open a session, what is served, ports."""

from __future__ import annotations

import asyncio
import json
import re
import socket
from collections.abc import Callable, Coroutine, Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest, HTTPResponse
from tornado.websocket import websocket_connect

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.workbench.page import Pages
from bouncing_disk_ros.workbench.page_server import COOKIE, PageServer
from support.page_client import token_of
from support.page_link import ListLink

Run = Callable[[Coroutine[Any, Any, Any]], Any]
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
def serve(run: Run, pages: Pages) -> Iterator[Callable[..., PageServer]]:
    made: list[PageServer] = []

    def make(address: str = "localhost", port: int = 0, **options: Any) -> PageServer:
        made.append(PageServer(pages.make, address, port, **options))
        return made[-1]

    yield make
    for server in made:
        server.close()


async def get(url: str, **options: Any) -> HTTPResponse:
    return await AsyncHTTPClient().fetch(HTTPRequest(url, request_timeout=30.0, **options))


def status(run: Run, url: str, **options: Any) -> int:
    """The HTTP status of a request."""
    try:
        return int(run(get(url, **options)).code)
    except HTTPClientError as error:
        return int(error.code)


async def open_session(server: PageServer, token: str, origin: str | None, cookie: str = "") -> Any:
    """Open a websocket as a page does; the first message, None where it is closed instead."""
    headers = {} if origin is None else {"Origin": origin}
    headers |= {"Cookie": cookie} if cookie else {}
    request = HTTPRequest(f"ws://127.0.0.1:{server.port}/ws", headers=headers)
    connection = await websocket_connect(request, subprotocols=["bokeh", token])
    first = await connection.read_message()
    connection.close()
    return None if first is None else json.loads(first)


def test_the_page_is_served_to_several_browsers(
    run: Run, serve: Callable[..., PageServer], pages: Pages
) -> None:
    server = serve()
    assert server.url == f"http://localhost:{server.port}/"
    bodies = [run(get(server.url)).body for _ in range(2)]
    assert len(pages.open) == 2
    tokens = {token_of(body) for body in bodies}
    assert len(tokens) == 2
    for token in tokens:
        first = run(open_session(server, token, f"http://localhost:{server.port}"))
        assert first["msgtype"] == "ACK"


def test_the_page_brings_all_it_needs_from_its_own_server(
    run: Run, serve: Callable[..., PageServer], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the environment asks Bokeh for another place, or for open doors."""
    monkeypatch.setenv("BOKEH_RESOURCES", "cdn")
    monkeypatch.setenv("BOKEH_ALLOW_WS_ORIGIN", "*")
    server = serve()
    body = run(get(server.url)).body.decode()
    sources = re.findall(r'(?:src|href)="([^"]+)"', body)
    assert sources
    assert {urlsplit(source).netloc for source in sources} <= {"", f"localhost:{server.port}"}
    token = token_of(body.encode())
    with pytest.raises(HTTPClientError, match="403"):
        run(open_session(server, token, "http://elsewhere.example"))


def test_a_page_from_elsewhere_opens_no_session(run: Run, serve: Callable[..., PageServer]) -> None:
    server = serve()
    token = token_of(run(get(server.url)).body)
    others = ("elsewhere.example", "localhost:1", "127.0.0.1.example", f"x.localhost:{server.port}")
    for origin in ("null", *(f"http://{other}" for other in others)):
        with pytest.raises(HTTPClientError, match="403"):
            run(open_session(server, token, origin))


def test_a_made_up_token_opens_no_session(run: Run, serve: Callable[..., PageServer]) -> None:
    server = serve()
    assert run(open_session(server, "made-up", f"http://localhost:{server.port}")) is None


def test_no_file_is_served_but_its_own(run: Run, serve: Callable[..., PageServer]) -> None:
    base = f"http://localhost:{serve().port}"
    for path in ("/etc/passwd", "/static/../../etc/passwd", "/static/%2e%2e/%2e%2e/x", "/..%2fx"):
        assert status(run, base + path) in (403, 404), path


def test_another_interface_needs_the_token_in_the_address(
    run: Run, serve: Callable[..., PageServer]
) -> None:
    server = serve(ALL)
    local = f"http://127.0.0.1:{server.port}/"
    assert server.token in server.url
    assert len(server.token) >= 32
    assert status(run, local) == 403
    assert status(run, f"{local}?token={server.token[:-1]}") == 403
    page = run(get(f"{local}?token={server.token}"))
    assert page.code == 200
    cookie = page.headers["Set-Cookie"].split(";")[0]
    assert cookie == f"{COOKIE}={server.token}"
    assert "HttpOnly" in page.headers["Set-Cookie"]
    assert "SameSite=Strict" in page.headers["Set-Cookie"]
    token, origin = token_of(page.body), f"http://127.0.0.1:{server.port}"
    assert run(open_session(server, token, origin, cookie))["msgtype"] == "ACK"
    assert run(open_session(server, token, origin)) is None, "without the token"
    with pytest.raises(HTTPClientError, match="403"):
        run(open_session(server, token, "http://elsewhere.example", cookie))


def test_a_port_in_use_is_one_clear_line(serve: Callable[..., PageServer]) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=r"in use.*-p port:=0") as caught:
            serve(port=port)
    assert str(port) in caught.value.line
    assert "\n" not in caught.value.line


def test_an_address_of_another_machine(serve: Callable[..., PageServer]) -> None:
    with pytest.raises(InputError, match=r"192\.0\.2\.1"):
        serve("192.0.2.1")


@pytest.mark.parametrize("origin", ["*", "http://a.example", "a b", "", "host:notaport"])
def test_further_origins_are_hosts(serve: Callable[..., PageServer], origin: str) -> None:
    with pytest.raises(InputError, match="host:port"):
        serve(origins=[origin])


def test_a_proxy_may_be_allowed(run: Run, serve: Callable[..., PageServer]) -> None:
    server = serve(origins=["Bench.Example:443"])
    token = token_of(run(get(server.url)).body)
    first = run(open_session(server, token, "https://bench.example:443"))
    assert first["msgtype"] == "ACK"
