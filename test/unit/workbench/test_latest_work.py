"""Of the work in a thread the newest alone counts."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from bouncing_disk_ros.workbench.latest_work import IsObsolete, LatestWork
from bouncing_disk_ros.workbench.tab import on_next_tick

PATIENCE = 60.0


def test_newer_work_makes_older_work_obsolete() -> None:
    latest, begun, done = LatestWork(), threading.Event(), []
    asked = threading.Event()

    def first(is_obsolete: IsObsolete) -> None:
        begun.set()
        assert not is_obsolete()
        assert asked.wait(PATIENCE)
        done.append(("first", is_obsolete()))

    latest.ask(first)
    assert begun.wait(PATIENCE)
    latest.ask(lambda _: done.append(("never", False)))
    latest.ask(lambda is_obsolete: done.append(("last", is_obsolete())))
    asked.set()
    latest.join()
    assert done == [("first", True), ("last", False)]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_error_ends_one_piece_of_work_alone() -> None:
    latest, done = LatestWork(), []

    def fail(_: IsObsolete) -> None:
        raise RuntimeError("of the test")

    latest.ask(fail)
    latest.join()
    latest.ask(lambda _: done.append(1))
    latest.join()
    assert done == [1]


def test_a_page_that_is_gone_is_left_alone() -> None:
    called: list[object] = []
    for destroyed in (True, False):
        session = SimpleNamespace(destroyed=destroyed)
        page = SimpleNamespace(session_context=session, add_next_tick_callback=called.append)
        on_next_tick(page, test_a_page_that_is_gone_is_left_alone)
    assert called == [test_a_page_that_is_gone_is_left_alone]
