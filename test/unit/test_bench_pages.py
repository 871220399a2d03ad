"""What `make bench` says of its rows: beside those of the last version, and on the page."""

from __future__ import annotations

import json

from bench.history import LAST
from bench.page import PAGE, with_table


def test_the_page_is_that_of_the_stored_run() -> None:
    page = PAGE.read_text("utf-8")
    assert with_table(page, json.loads(LAST.read_text("utf-8"))) == page
