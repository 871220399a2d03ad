"""A disk that bounces and turns on a vibrating platform, simulated exactly and in real time.

What a user calls is a name of this package (`dir(bouncing_disk_ros)`), or in `bag`, `plots` and
`study`; none but `SimulatorNode` needs ROS:

>>> from bouncing_disk_ros import basins, fixed_point, simulate
>>> impacts = simulate(10.0, axial_forcing=0.45, frequency=3.0).impacts
>>> fixed_point(0.45, 0.5).multipliers
>>> basins(axial_forcing=0.34, width=60, height=60)["fraction"]

docs/architecture.md says which folder holds what, and which may import which.

Importing the package is cheap: what is named below is loaded when first used.
"""

from __future__ import annotations

import bouncing_disk_ros.command_line.safe_path  # before anything else is looked for

# isort: split
import bouncing_disk_ros.command_line.stop  # noqa: F401 (before what takes time)

# isort: split
import functools

from bouncing_disk_ros.executables import STUDIES as _STUDIES
from bouncing_disk_ros.kernel_cache import use_numba_cache as _use_numba_cache
from bouncing_disk_ros.public_names import PublicNames as _PublicNames

_use_numba_cache()  # before a kernel is compiled or loaded


@functools.cache
def _announce_compilation() -> None:
    """Let the first compilation of a kernel say on stderr what it is; once."""
    from bouncing_disk_ros.kernel_cache import announce_compilation

    announce_compilation(__name__, own_process=False)


def _study_function(name: str) -> object:
    from bouncing_disk_ros.study.runner import study_function

    _announce_compilation()
    return study_function(name)


def _version() -> str:
    """Return the version of the sources (package.xml beside them), else the installed one."""
    from importlib.metadata import version
    from pathlib import Path
    from xml.etree import ElementTree as ET

    manifest = Path(__file__).resolve().parent.parent / "package.xml"
    if manifest.is_file():
        return ET.parse(manifest).getroot().findtext("version") or ""  # noqa: S314 (our own file)
    return version("bouncing_disk_ros")


_made = {
    name: functools.partial(_study_function, name)
    for name, (module, _) in _STUDIES.items()
    if not module.startswith(f"{name}.")  # its name is that of a folder of this package
}
_names = _PublicNames(__name__, __file__, {"__version__": _version, **_made})
NEED_ROS = ("SimulatorNode",)
"""Public names that cannot be had where ROS 2 is not installed: not in __all__."""
__all__ = [name for name in _names.all if name not in NEED_ROS]
__dir__ = _names.listed


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562): kernels may have to be compiled first."""
    if name in NEED_ROS:
        from bouncing_disk_ros.command_line.environment import ros_is_here

        if not ros_is_here():
            raise ImportError(f"{name} needs ROS 2, which is not installed here")
    if _names.homes.get(name, ".") not in (".", ".errors"):  # these have no kernels
        _announce_compilation()
    return _names.load(name)
