"""The layout holds: who may import whom, what importing costs; and the pages on it name what
exists."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "bouncing_disk_ros"
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
FOLDERS = re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)
ARROWS = re.findall(r"^  (\w+) --> (\w+)$", PAGE, re.MULTILINE)


def reached(folder: str) -> set[str]:
    """A folder and all to which the arrows of the page's diagram lead from it."""
    return {folder}.union(*(reached(below) for above, below in ARROWS if above == folder))


TABLES = {
    "angles", "animation", "bounded", "colours", "distributions", "errors",
    "executables", "field_checks", "matplotlib_figures", "folders", "help_text", "impact_layout",
    "kernel_cache", "limits", "niceness", "parameters", "parsing", "public_names", "regular_file",
    "running_numbers", "scalar_search", "side_window", "sliders", "topics", "units",
}  # fmt: skip
#: folder of an extension -> the folders it may import; no folder of the base imports one of these
EXTENSIONS = {
    "motor_study": {"motor_study", "study", "report", "maps", "core"},
    "orbit_studies": {"orbit_studies", "study", "report", "maps", "core"},
    "juggling": {"juggling", "command_line", "study", "report", "ros", "run", "maps", "core"},
    "measured": {"measured", "command_line", "report", "run", "maps", "core", "bag"},
    "proof": {"proof", "report", "ros", "run", "core", "bag"},
    "testing": {"testing", "command_line", "nodes", "ros", "run", "core"},
    "cases": {"cases", "command_line", "proof", "run", "core"},
    "workbench": reached("workbench"),
}
BASE = {folder: reached(folder) for folder in FOLDERS if folder not in EXTENSIONS}
MAY_IMPORT = {
    **{folder: may | TABLES for folder, may in (BASE | EXTENSIONS).items()},
    "core": {"core", "kernel_cache", "impact_layout", "errors", "field_checks"},
    **dict.fromkeys(TABLES, TABLES),
    "__init__": {*TABLES, "command_line", "study"},
    "plots": TABLES,
    "__main__": {*TABLES, "command_line"},
}
#: libraries from outside that the package may import; kernels and the core those of `NUMBERS` alone
NUMBERS = {"numpy", "numba"}
LIBRARIES = NUMBERS | {
    "IPython", "PIL", "bokeh", "distributed", "flint", "google_crc32c", "lz4", "numcodecs",
    "matplotlib", "mcap", "messages", "netCDF4", "pytest", "rclpy", "rosbags", "soundfile",
    "tornado", "tqdm", "xarray", "yaml", "zstandard",
}  # fmt: skip
#: modules of the standard library that the core, which knows no clock, log or file, may not use
NOT_IN_CORE = {
    "time", "datetime", "logging", "os", "pathlib", "io", "random", "threading", "socket",
}  # fmt: skip

#: what the core and controllers may use of libraries of numbers: nothing whose last digits are the
#: library's choice
EXACT = {
    "math": {"ceil", "comb", "floor", "inf", "isfinite", "isnan", "nan", "pi", "remainder", "sqrt",
             "tau"},
    "np": {"arange", "array", "ascontiguousarray", "concatenate", "dtype", "empty", "finfo",
           "empty_like", "flatnonzero", "float32", "float64", "inf", "int8", "int32", "int64",
           "roll", "uint8", "uint64", "unique", "void", "zeros"},
}  # fmt: skip

FILES = sorted(PACKAGE.rglob("*.py"))
MODULES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts): file
    for file in FILES
    if file.stem != "__init__"
}

LINKS = sorted(set(re.findall(r"\[`([^`]+)`\]\(\.\./(bouncing_disk_ros/[^)]+\.py)\)", PAGE)))
MODEL = (ROOT / "docs" / "model.md").read_text("utf-8")
_NAMED = re.findall(r"`([a-z_]+\.[A-Za-z_]+)`", MODEL.split("## What is proved")[0])
FUNCTIONS = sorted(set(_NAMED) - {"bouncing_disk_ros.core"})


@cache
def parsed(file: Path) -> ast.Module:
    return ast.parse(file.read_text("utf-8"))


def package(file: Path) -> str:
    """`core`, `errors`: the first part of a module's name below the package."""
    return file.relative_to(PACKAGE).with_suffix("").parts[0]


def has_kernels(file: Path) -> bool:
    """Whether a module declares compiled functions: all of `core`, and some beside it."""
    compilers = {"bouncing_disk_ros.core.compilation", "bouncing_disk_ros.maps.lanes.lane_basics"}
    return package(file) == "core" or bool(compilers & modules_of(imports(file)))


def is_a_controller(file: Path) -> bool:
    """Whether a module of `juggling` computes what a controller commands."""
    shell = {"options", "picture", "compute", "juggle", "juggle_node"}
    return package(file) == "juggling" and file.stem not in shell


def statements(of: Any) -> Iterator[ast.stmt]:
    """All statements within a module or a statement."""
    for field in ("body", "orelse", "handlers", "finalbody", "cases"):
        for one in getattr(of, field, ()):
            yield one
            yield from statements(one)


@cache
def imports(file: Path) -> list[str]:
    """The absolute name of everything that `file` imports, within functions too."""
    found: list[str] = []
    for node in statements(parsed(file)):
        if isinstance(node, ast.Import):
            found += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            found += (f"{node.module}.{alias.name}" for alias in node.names)
    return found


def library(name: str) -> str:
    top = name.split(".")[0]
    is_message = top.endswith(("_msgs", "_interfaces")) or top == "std_srvs"
    return "messages" if is_message else top


def identify(file: Path) -> str:
    return str(file.relative_to(PACKAGE))


def modules_of(names: Iterable[str]) -> set[str]:
    """The modules of the package among what is imported."""
    found = {target for name in names for target in (name, name.rpartition(".")[0])}
    return found & {*MODULES}


def test_imports_point_down_in_no_circle_and_to_known_libraries() -> None:
    """Within functions too; the core knows no clock, log or file."""
    for file in FILES:
        names = [name for name in imports(file) if name.startswith("bouncing_disk_ros.")]
        own = {name.split(".")[1] for name in names} - {"__version__"}
        assert own <= MAY_IMPORT[package(file)], f"{identify(file)}: not allowed by MAY_IMPORT"
        outside = {library(name) for name in imports(file)} - {"bouncing_disk_ros"}
        allowed = NUMBERS if package(file) in ("core", "maps") else LIBRARIES
        foreign = outside - set(sys.stdlib_module_names)
        assert foreign <= allowed, f"{identify(file)}: not allowed by LIBRARIES"
        assert not has_kernels(file) or not outside & NOT_IN_CORE, identify(file)
    uses = {name: modules_of(imports(file)) for name, file in MODULES.items()}
    tuple(TopologicalSorter(uses).static_order())  # raises CycleError, which names the circle


MAX_DEPTH = 12
"""Longest chain of modules of the base in which each loads the next one while it loads."""


def test_chains_of_imports_of_the_base_are_short() -> None:
    uses = {}
    for name, file in MODULES.items():
        loads = [node for node in parsed(file).body if isinstance(node, ast.ImportFrom)]
        uses[name] = modules_of(f"{n.module}.{alias.name}" for n in loads for alias in n.names)
    depth: dict[str, int] = {}
    for name in TopologicalSorter(uses).static_order():
        depth[name] = 1 + max((depth[used] for used in uses[name]), default=0)
    base = {name: depth[name] for name, file in MODULES.items() if package(file) not in EXTENSIONS}
    deepest = max(base, key=base.__getitem__)
    assert base[deepest] <= MAX_DEPTH, deepest


def test_each_file_of_tests_has_a_name_of_its_own() -> None:
    """With launch_testing, which every ROS machine has, two equal names end the whole run."""
    names = [path.name for path in (ROOT / "test").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))


def test_core_and_controllers_have_the_same_bits_with_every_version_of_their_libraries() -> None:
    """A sine of the C library or a matrix of LAPACK has other last digits on another machine."""
    for file in (f for f in FILES if package(f) == "core" or is_a_controller(f)):
        used = {
            (node.value.id, node.attr)
            for node in ast.walk(parsed(file))
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
        }
        others = {f"{of}.{name}" for of, name in used if of in EXACT and name not in EXACT[of]}
        assert others == set(), identify(file)
        direct = {name for name in imports(file) if name.startswith(("math.", "numpy."))}
        assert direct <= {"numpy.typing.NDArray"}, f"{identify(file)}: import the module itself"


def test_controllers_take_no_powers_of_variables() -> None:
    """A power is the C library's too: its last digit differs from that of the product."""
    for file in (f for f in FILES if is_a_controller(f)):
        powers = [node for node in ast.walk(parsed(file)) if isinstance(node, ast.BinOp)]
        bases = {ast.unparse(node.left) for node in powers if isinstance(node.op, ast.Pow)}
        variables = {base for base in bases if not base.replace(".", "").isdigit()}
        assert variables == set(), identify(file)


def names_of(file: Path) -> set[str]:
    """Names that a module defines; methods as `Class.method`."""
    names = set()
    for node in parsed(file).body:
        if isinstance(node, ast.ClassDef):
            names |= {f"{node.name}.{n.name}" for n in node.body if isinstance(n, ast.FunctionDef)}
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names.add(node.name)
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names |= {n.id for t in targets if t for n in ast.walk(t) if isinstance(n, ast.Name)}
    return names


def test_links_of_the_page_lead_to_what_they_name() -> None:
    assert len(LINKS) > 35
    for name, path in LINKS:
        assert path.endswith(name) or name in names_of(ROOT / path), name
        assert (ROOT / path).is_file()
    life = PAGE.split("## The life of a command")[1].split("\n## ")[0]
    assert len(life.strip().splitlines()) <= 40


def test_arrows_of_the_diagram_are_allowed_imports() -> None:
    assert len(ARROWS) > 10
    for above, below in ARROWS:
        assert below in MAY_IMPORT[above], f"{above} --> {below}"
    for place, (folder, imported) in enumerate(BASE.items(), start=1):
        assert imported <= {*FOLDERS[:place]}, f"{folder}: not above it in the table"
    assert {*FOLDERS} == {f.parent.name for f in PACKAGE.glob("*/__init__.py")}


def test_functions_of_the_model_page_exist() -> None:
    assert len(FUNCTIONS) > 40
    for named in FUNCTIONS:
        module, name = named.split(".")
        homes = [file for file in FILES if file.stem == module]
        assert any(name in names_of(file) for file in homes), named
