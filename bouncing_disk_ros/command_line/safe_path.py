"""The current folder is no place to look for modules: what importing the package does first.

`python -m` puts the current folder before the standard library, so a file yaml.py that somebody has
left there would run with the rights of the user who starts a simulator in it. Loads nothing that is
not loaded already.
"""

from __future__ import annotations

import os
import sys


def leave_current_folder_out() -> None:
    """Under `python -m`, take the current folder out of the search for modules, as `-P` does.

    Processes that this one starts do the same. Where the package itself lies in the folder,
    unpacked and not installed, it is searched last instead.
    """
    if sys.argv[:1] != ["-m"] or sys.flags.safe_path or not sys.path:
        return  # `python -m` has put nothing there, or has found its module already
    try:
        current = os.getcwd()  # noqa: PTH109 (pathlib is not loaded yet)
    except OSError:  # the folder is gone
        return
    if sys.path[0] not in ("", current):
        return
    del sys.path[0]
    home = os.path.abspath(f"{__file__}/../../..")  # noqa: PTH100 (of the package)
    if os.path.realpath(home) == os.path.realpath(current):
        sys.path.append(current)
    else:
        os.environ["PYTHONSAFEPATH"] = "1"


leave_current_folder_out()
