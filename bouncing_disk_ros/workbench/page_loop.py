"""The loop that serves the page until a signal, whatever run is behind it."""

from __future__ import annotations

import asyncio
import importlib
import os
import sys
import threading
import webbrowser
from collections.abc import Callable, Mapping

from tornado.ioloop import IOLoop, PeriodicCallback

from bouncing_disk_ros.parameters import Value, items_of
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.workbench.page import Pages
from bouncing_disk_ros.workbench.page_server import PageServer, is_local
from bouncing_disk_ros.workbench.run_link import RunLink

LOOK_MS = 200
"""So often a signal is looked for, and the link."""


def _load_maps() -> None:
    """Load what maps are computed with: some seconds, which the first look would take."""
    importlib.import_module("bouncing_disk_ros.workbench.basin_pane")
    importlib.import_module("bouncing_disk_ros.workbench.bifurcation_pane")


def _nothing() -> None:
    """Where there is nothing to look after."""


def serve(
    values: Mapping[str, Value],
    link: RunLink,
    stop: Stop,
    look_after: Callable[[], object] = _nothing,
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
