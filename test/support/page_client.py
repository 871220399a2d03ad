"""A page of the workbench opened from Python through its websocket, as a browser opens it.

Not Bokeh's own client: that one drops the server's patches while it waits for an answer.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from bokeh.client.websocket import WebSocketClientConnectionWrapper
from bokeh.document import Document
from bokeh.document.events import MessageSentEvent, ModelChangedEvent
from bokeh.events import ButtonClick
from bokeh.protocol import Protocol
from bokeh.protocol.receiver import Receiver
from tornado.httpclient import AsyncHTTPClient, HTTPRequest, HTTPResponse
from tornado.websocket import websocket_connect

from support.bokeh_page import model
from support.processes import PATIENCE, wait_until


def token_of(page: bytes) -> str:
    """The token of the session that a page brings, for its websocket."""
    found = re.search(r'"token":"([^"]+)"', page.decode())
    assert found is not None
    return found[1]


def cookie_of(page: HTTPResponse) -> str:
    """The cookie that a page brings, for its other requests."""
    return page.headers["Set-Cookie"].split(";")[0]


class PageClient:
    """One page at an address; `acknowledges` what it has drawn, as a browser that is seen does."""

    def __init__(self, url: str, *, acknowledges: bool = True) -> None:
        self._loop = asyncio.new_event_loop()
        self._protocol = Protocol()
        self._receiver = Receiver(self._protocol)
        self._acknowledges, self._end = acknowledges, -1.0
        self._waiting: Any = None
        self.frames = 0
        self.document = Document()
        self._run(self._open(url))

    def _run(self, work: Any) -> Any:
        asyncio.set_event_loop(self._loop)
        return self._loop.run_until_complete(asyncio.wait_for(work, PATIENCE))

    async def _open(self, url: str) -> None:
        http = AsyncHTTPClient(force_instance=True)
        page = await http.fetch(HTTPRequest(url, request_timeout=PATIENCE))
        http.close()
        place = urlsplit(url)
        headers = {"Origin": f"http://{place.netloc}", "Cookie": cookie_of(page)}
        request = HTTPRequest(f"ws://{place.netloc}/ws", headers=headers)
        token = token_of(page.body)
        self._socket: Any = await websocket_connect(request, subprotocols=["bokeh", token])
        await self._next()  # ACK
        await self._send(self._protocol.create("PULL-DOC-REQ"))
        while (message := await self._next()).msgtype != "PULL-DOC-REPLY":
            pass
        message.push_to_document(self.document)
        self.document.models.flush_synced()  # the server knows these models: they go by their id

    async def _send(self, message: Any) -> None:
        await message.send(WebSocketClientConnectionWrapper(self._socket))

    async def _next(self) -> Any:
        """The next message of the server."""
        message = None
        while message is None:
            fragment = await self._socket.read_message()
            assert fragment is not None, "the server has closed the page"
            message = await self._receiver.consume(fragment)
        return message

    async def _pump(self) -> None:
        """Take the next message, if one comes within a moment."""
        self._waiting = self._waiting or asyncio.ensure_future(self._next())
        done, _ = await asyncio.wait([self._waiting], timeout=0.05)
        if done:
            message, self._waiting = self._waiting.result(), None
            if message.msgtype == "PATCH-DOC":
                message.apply_to_document(self.document)
                await self._acknowledge()

    async def _acknowledge(self) -> None:
        times = self.model("path").data["time"]
        end = float(times[-1]) if len(times) else -1.0
        if end != self._end:
            self._end = end
            self.frames += 1
            if self._acknowledges:
                await self._change("shown_time", "end", end)

    async def _change(self, name: str, attribute: str, value: Any) -> None:
        event = ModelChangedEvent(self.document, self.model(name), attribute, value)
        await self._send(self._protocol.create("PATCH-DOC", [event]))

    def model(self, name: str) -> Any:
        """The model of a name, as the server has last sent it."""
        return model(self.document, name)

    def change(self, name: str, attribute: str, value: Any) -> None:
        """Change a property, as a browser does."""
        self._run(self._change(name, attribute, value))

    def click(self, name: str) -> None:
        """Click a button, as a browser does."""
        event = MessageSentEvent(self.document, "bokeh_event", ButtonClick(model=self.model(name)))
        message = self._protocol.create("PATCH-DOC", [event])
        self._run(self._send(message))

    def wait(self, condition: Callable[[], Any], timeout: float = PATIENCE) -> None:
        """Let messages of the server come until a condition holds."""

        def told() -> str:
            return f"no such thing after {self.frames} frames: {self.model('status').text}"

        wait_until(condition, lambda: self._run(self._pump()), told, timeout)

    def close(self) -> None:
        """Close the page; again: nothing."""
        if self._loop.is_closed():
            return
        asyncio.set_event_loop(self._loop)
        if self._waiting is not None:
            self._waiting.cancel()
        self._socket.close()
        self._run(asyncio.sleep(0))
        asyncio.set_event_loop(None)
        self._loop.close()
