"""What holds around slow imports, and after them."""

from __future__ import annotations

import gc
import signal
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest

from bouncing_disk_ros.ros.stop import Stop, ending_at_once


@pytest.mark.parametrize("around", [Stop().importing, lambda: ending_at_once("tool")])
@pytest.mark.parametrize("fails", [False, True])
def test_imports_are_not_searched_for_cycles(
    around: Callable[[], AbstractContextManager[None]], fails: bool
) -> None:
    before = signal.getsignal(signal.SIGINT)
    try:
        with around():
            assert not gc.isenabled()
            if fails:
                raise ImportError
    except ImportError:
        assert fails
    finally:
        gc.unfreeze()  # the objects of the tests
    assert gc.isenabled()
    assert signal.getsignal(signal.SIGINT) is before
