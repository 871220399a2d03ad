"""Executables called within the process of the test: for what ends before anything is made."""

from __future__ import annotations

import gc
import importlib
import signal

import pytest

from bouncing_disk_ros.executables import module_of


def ends(
    capfd: pytest.CaptureFixture[str], name: str, *arguments: str
) -> tuple[int, str, list[str]]:
    """Exit code, stdout and lines of stderr of an executable with a command line."""
    handlers = {number: signal.getsignal(number) for number in (1, 2, 15)}
    capfd.readouterr()
    try:
        code = int(importlib.import_module(module_of(name)).main(arguments))
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        gc.unfreeze()
    out, err = capfd.readouterr()
    return code, out, err.splitlines()
