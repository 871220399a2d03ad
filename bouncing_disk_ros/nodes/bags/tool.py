"""What the tools that read a bag without ROS share: how their errors end them."""

from __future__ import annotations

import sys
from collections.abc import Callable

from bouncing_disk_ros.errors import ExitCode, InputError


def run_bag_tool(name: str, path: str, work: Callable[[], int], interrupted: str = "") -> int:
    """Do the work on the bag at `path`; the exit code. Every error is one line on stderr.

    `interrupted` is what to say when KeyboardInterrupt ends the work, if not just that.
    """
    from bouncing_disk_ros.bag import BagError

    try:
        return work()
    except InputError as error:
        print(f"{name}: {error.line}", file=sys.stderr)
        return ExitCode.BAD_INPUT
    except (BagError, OSError) as error:
        print(f"{name}: {path}: {error}", file=sys.stderr)
        return ExitCode.FAILED
    except KeyboardInterrupt:
        print(interrupted or f"{name}: interrupted", file=sys.stderr)
        return ExitCode.INTERRUPTED
