"""A pytest plugin that collects as launch_testing does on every ROS 2 machine.

It imports each module of tests under its base name before pytest makes a module of it, to look for
a launch description, and lets any error but a SyntaxError pass. So two modules of one base name
fail, and a module that skips itself while it is imported takes its whole folder along.

    PYTHONPATH=test:. pytest --collect-only -p support.launch_collection
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import pytest
from _pytest.pathlib import import_path  # launch_testing takes it too: what it does is the trap


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module:
    """Import a module by its base name, then leave it to pytest."""
    options: dict[str, Any] = {"root": None}
    if "consider_namespace_packages" in inspect.signature(import_path).parameters:  # pytest 8.1 on
        options["consider_namespace_packages"] = False
    module = import_path(module_path, **options)
    assert not hasattr(module, "generate_test_description"), "the suite has no launch tests"
    return pytest.Module.from_parent(parent, path=module_path)
