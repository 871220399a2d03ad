"""Standard output that takes any text, and outlives its reader."""

from __future__ import annotations

import io
import os
import stat
import sys
from typing import Any


class _Pipe(io.FileIO):
    """A pipe to a reader that may go (`| head`): what is written later is dropped quietly."""

    reader_is_gone = False

    def write(self, data: Any) -> int:
        """Write, or drop what nobody reads."""
        try:
            return super().write(data)
        except BrokenPipeError:
            self.reader_is_gone = True
            os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            return memoryview(data).nbytes


def _open_closed_streams() -> None:
    """Let standard streams that were closed (`2>&-`) lead nowhere.

    Else the next files get their numbers, and what libraries print goes into them.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest number that is free
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, "w" if number else "r", closefd=False))


def prepare_stdout() -> None:
    """Let stdout take any text and outlive its reader; all standard streams are open then.

    Letters that the terminal's encoding lacks are shown as escapes, as on stderr. What is written
    to a pipe whose reader has gone is dropped: the work goes on and its files are written.
    """
    _open_closed_streams()
    out = sys.stdout
    if not isinstance(out, io.TextIOWrapper):
        return  # captured
    out.reconfigure(errors="backslashreplace")
    try:
        is_pipe = out is sys.__stdout__ and stat.S_ISFIFO(os.fstat(out.fileno()).st_mode)
    except OSError:
        return
    if is_pipe:
        out.flush()
        pipe = io.BufferedWriter(_Pipe(out.fileno(), "wb", closefd=False))
        sys.stdout = io.TextIOWrapper(
            pipe, encoding=out.encoding, errors=out.errors, line_buffering=out.line_buffering,
            write_through=out.write_through,
        )  # fmt: skip


def reader_is_gone() -> bool:
    """Whether stdout is a pipe whose reader was found to have gone."""
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return isinstance(raw, _Pipe) and raw.reader_is_gone
