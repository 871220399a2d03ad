"""What the tools that read a bag without ROS share: how their errors end them, and progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bouncing_disk_ros.errors import ExitCode, FailedError, InputError, one_line
from bouncing_disk_ros.ros.stop import ending_at_once


def run_bag_tool(name: str, path: str, work: Callable[[], int], interrupted: str = "") -> int:
    """Do the work on the bag at `path`; the exit code. Every error is one line on stderr.

    A bag that is damaged or untrue is bad input. `interrupted` is what to say when
    KeyboardInterrupt ends the work, if not just that.
    """
    with ending_at_once(name):
        from bouncing_disk_ros.bag import BagError

    try:
        return work()
    except InputError as error:
        print(f"{name}: {error.line}", file=sys.stderr)
        return ExitCode.BAD_INPUT
    except FailedError as error:
        print(f"{name}: {one_line(str(error))}", file=sys.stderr)
        return ExitCode.FAILED
    except (BagError, OSError) as error:
        text = one_line(str(error))
        where = "" if path in text else f"{path}: "
        print(f"{name}: {where}{text}", file=sys.stderr)
        return ExitCode.BAD_INPUT if isinstance(error, BagError) else ExitCode.FAILED
    except KeyboardInterrupt:
        # One that has passed through exec() of a text, as rosbags and dataclasses use it, makes
        # CPython end by SIGINT whatever the exit code, until another text has been run.
        exec("")  # noqa: S102
        print(interrupted or f"{name}: interrupted", file=sys.stderr)
        return ExitCode.INTERRUPTED


@contextmanager
def walking(name: str) -> Iterator[Callable[[int, int], None]]:
    """A watch for `bag.open`: on a terminal, a bar while files are walked through."""
    from tqdm import tqdm

    bar = tqdm(desc=name, unit="B", unit_scale=True, leave=False, disable=None, delay=0.5)

    def watch(passed: int, size: int) -> None:
        bar.total = size
        bar.update(passed - bar.n)

    try:
        yield watch
    finally:
        bar.close()
