"""A disk that bounces and turns on a vibrating platform, simulated exactly and in real time.

The packages, from the top; imports point down only:

| package | what it holds | may import |
|---|---|---|
| `nodes` | the executables, one package for each kind | all below |
| `testing` | a pytest fixture with a stepped simulator, for tests of one's own | all below |
| `ros` | conversions between messages and numbers, QoS, parameters | `run`, `core` |
| `plots` | results in, figures out | `analysis`, `core` |
| `run` | one run without ROS: clocks, validation of commands, the record of inputs | `core` |
| `study` | long work in chunks: stored as it grows, resumed, on many cores | `analysis`, `core` |
| `analysis` | arrays in, results out | `core` |
| `bag` | bytes and messages, never physics: write, read and mend bags | mcap, rosbags |
| `core` | the physics: numbers in, numbers out; no clock, log, file or ROS | numpy, numba |

Beside them the tables that every package but `core` may read: `parameters`, `topics`, `errors`,
`executables`, `limits`, `environment` with `folders`, `kernel_cache` and `safe_path`.

Importing the package is cheap: what is named below is loaded when first used.
"""

from __future__ import annotations

import bouncing_disk_ros.safe_path  # noqa: F401 (before anything else is looked for)

# isort: split
import importlib
from typing import TYPE_CHECKING

from bouncing_disk_ros.kernel_cache import use_numba_cache as _use_numba_cache

if TYPE_CHECKING:
    from bouncing_disk_ros.core.simulation import Simulation
    from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
    from bouncing_disk_ros.ros.from_messages import impacts_from_msg
    from bouncing_disk_ros.run.simulate import simulate

__all__ = ["Simulation", "SimulatorNode", "__version__", "impacts_from_msg", "simulate"]

#: public name -> the module that has it
_HOMES = {
    "Simulation": "bouncing_disk_ros.core.simulation",
    "SimulatorNode": "bouncing_disk_ros.nodes.simulator.simulator_node",
    "impacts_from_msg": "bouncing_disk_ros.ros.from_messages",
    "simulate": "bouncing_disk_ros.run.simulate",
}

_use_numba_cache()  # before anything here imports numba, which reads the setting once


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    if name == "__version__":
        value: object = _version()
    elif name in _HOMES:
        value = getattr(importlib.import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*globals(), *__all__})


def _version() -> str:
    """Return the version of the sources (package.xml beside them), else the installed one."""
    from importlib.metadata import version
    from pathlib import Path
    from xml.etree import ElementTree as ET

    manifest = Path(__file__).resolve().parent.parent / "package.xml"
    if manifest.is_file():
        return ET.parse(manifest).getroot().findtext("version") or ""  # noqa: S314 (our own file)
    return version("bouncing_disk_ros")
