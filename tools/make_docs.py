"""Build the documentation as web pages: the guides in docs/, and the API from the docstrings.

    python tools/make_docs.py [FOLDER]      (default: output/docs)

The pages go to FOLDER/html. Sphinx reads a copy of the guides in which links that leave docs/ lead
to copies of what they name. Any warning is an error, and so is a public name without a place in
`SECTIONS`.
"""

from __future__ import annotations

import inspect
import re
import shutil
import sys
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

import bouncing_disk_ros
from bouncing_disk_ros import plots
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.executables import STUDIES

ROOT = Path(__file__).resolve().parents[1]
#: pages of the repository's top level -> their names beside the guides
TOP = {
    "README.md": "readme.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.rst": "changelog.rst",
}
GUIDES = {
    "Begin": ("readme", "installation", "commands", "workbench", "examples", "tutorial", "figures"),
    "For you": ("for_dynamicists", "for_roboticists", "for_motor_designers", "for_teachers"),
    "Guides": (
        "studies",
        "motor",
        "recording",
        "replay",
        "report",
        "measured",
        "testing",
        "closed_loops",
        "juggling",
        "reference_cases",
        "troubleshooting",
    ),
    "Reference": ("api", "model", "interfaces", "parameters", "security", "performance"),
    "Development": ("architecture", "contributing", "changelog"),
}
_FUNCTIONS = [name for name in STUDIES if name in bouncing_disk_ros.__all__]
#: page of the API -> what it is about, and the names of the package on it
SECTIONS: dict[str, tuple[str, str]] = {
    "Simulate": (
        "Runs of the disk without ROS and without a clock.",
        "simulate Result Simulation load_preset preset_names load_programme programme_names",
    ),
    "Studies": (
        """Long computations with their results as datasets: [studies](studies.md). All take the
        [parameters](parameters.md) of their table as keywords.""",
        " ".join([*_FUNCTIONS, "run_study open_result figures study"]),
    ),
    "Next-collision map": (
        "From impact to impact, in units of the forcing: the map, its orbits and their curves.",
        """NextCollisionMap MapState Impacts PeriodicOrbit fixed_point periodic_orbit
        period_doublings orbit_curve curve_family Curve Window best_lag""",
    ),
    "Attractors and basins": (
        "What exists beside what, which start ends where, and how mixed the basins are.",
        """Attractor AttractorKind Attractors find_attractors label_starts spread_starts
        basin_entropy box_dimension uncertainty_exponent""",
    ),
    "Resilience of an orbit": (
        "How far from failure an orbit is: [resilience](resilience.md).",
        """instants_of fatal_impulses fatal_timing_errors FatalRule edge_state EdgeState saddle_of
        saddle_manifolds Manifold GrowthRule enclosed_share""",
    ),
    "Single tosses": ("One toss from rest in closed form.", "toss TossSetting"),
    "Recorded runs": (
        "What a bag says of a run; the guide is [recording](recording.md).",
        """read_run RunRecord summary_of orbit_of Orbit restitution_of friction_of Estimate
        platform_velocities impacts_from_msg bag""",
    ),
    "Measured impacts": (
        "From measured times of impacts to a model: [measured impacts](measured.md).",
        "fit_impacts ImpactFit impact_times ImpactSound",
    ),
    "Reference cases": (
        "How far a simulator is from the rigid-impact law: [reference cases](reference_cases.md).",
        "reference_cases reference_case ReferenceCase compare_with_case Comparison",
    ),
    "Figures": ("What is drawn of results; `figures` draws those of any study.", "plots"),
    "Errors": ("What is raised.", "InputError FailedError"),
    "With ROS 2": ("The node, and the simulator of [tests](testing.md).", "SimulatorNode"),
}
MODULES = {
    "bag": ("open", "Bag", "Writer", "Options", "recover", "Message", "Topic", "BagError"),
    "study": ("named", "run", "export", "export_tables", "Study", "Progress"),
    "plots": tuple(plots.__all__),
}  # fmt: skip
NEED_ROS = ("nodes.simulator.simulator_node.SimulatorNode", "testing.SteppedSimulator")
MOCKED = (
    "ament_index_python", "builtin_interfaces", "diagnostic_msgs", "geometry_msgs",
    "lifecycle_msgs", "rcl_interfaces", "rclpy", "rosgraph_msgs", "sensor_msgs", "std_msgs",
    "std_srvs", "tf2_msgs", "trajectory_msgs",
)  # fmt: skip
SETTINGS: dict[str, Any] = {
    "project": "bouncing_disk_ros",
    "version": bouncing_disk_ros.__version__,
    "extensions": ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"],
    "myst_heading_anchors": 4,
    "autodoc_mock_imports": list(MOCKED),  # the same pages with ROS and without
    "autodoc_typehints_format": "short",
    "autodoc_default_options": {"members": True, "member-order": "bysource"},
    "python_use_unqualified_type_names": True,
    "html_theme": "furo",
    "html_title": f"bouncing_disk_ros {bouncing_disk_ros.__version__}",
    "html_copy_source": False,
}
_LINK = re.compile(r"(\]\()([^)#\s]+)((?:#[^)]*)?\))")
_FIELD = re.compile(r"^    (\w+): [^#]*#:? (.+)$")


# the guides ---------------------------------------------------------------------------------------


def copy_guides(source: Path) -> None:
    """Copy the pages with their figures; links that leave docs/ lead to copies."""
    shutil.copytree(ROOT / "docs" / "figures", source / "figures")
    for page in (*(ROOT / "docs").glob("*.md"), *(ROOT / name for name in TOP)):
        name = TOP.get(page.name, page.name) if page.parent == ROOT else page.name
        text = page.read_text("utf-8").replace("```mermaid", "```text")

        def moved(match: re.Match[str], folder: Path = page.parent) -> str:
            return match[1] + target(match[2], folder, source) + match[3]

        (source / name).write_text(_LINK.sub(moved, text), "utf-8")


def target(link: str, folder: Path, source: Path) -> str:
    """Where a link of a page in `folder` leads among the copies; what it names is copied."""
    if "://" in link:
        return link
    path = (folder / link).resolve().relative_to(ROOT)
    if str(path) in TOP:
        return TOP[str(path)]
    if path.parts[0] == "docs" and path.parts[1] != "notebooks":
        return str(path.relative_to("docs"))
    copy = source / "files" / path
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(ROOT / path, copy)
    return str(copy.relative_to(source))


def index() -> str:
    """The first page: a list of all others."""
    lines = ["# bouncing_disk_ros", "", "A disk that bounces and turns on a vibrating platform,"]
    lines += ["simulated exactly and in real time. The geometry is in [the model](model.md).", ""]
    listed = {page for pages in GUIDES.values() for page in pages}
    new = sorted({path.stem for path in (ROOT / "docs").glob("*.md")} - listed)
    for caption, pages in {**GUIDES, "Guides": (*GUIDES["Guides"], *new)}.items():
        lines += ["```{toctree}", f":caption: {caption}", ":maxdepth: 1", "", *pages, "```", ""]
    return "\n".join(lines)


# the API ------------------------------------------------------------------------------------------


def directive(name: str) -> list[str]:
    """What documents a name of the package: `simulate`, `bag.Writer`."""
    place: Any = bouncing_disk_ros
    for part in name.split(".") if name not in NEED_ROS else ():
        place = getattr(place, part)
    kind = "autofunction" if inspect.isfunction(place) else "autoclass"
    return ["```{eval-rst}", f".. {kind}:: bouncing_disk_ros.{name}", "```", ""]


def api() -> dict[str, str]:
    """The pages of the API by file name. ValueError: a public name is on no page, or on two."""
    listed = [name for _, names in SECTIONS.values() for name in names.split()]
    public = [*bouncing_disk_ros.__all__, *bouncing_disk_ros.NEED_ROS]
    public.remove("__version__")
    if sorted(listed) != sorted(public):
        raise ValueError(f"SECTIONS and __all__ differ: {set(listed) ^ set(public)}")
    pages = {
        f"api_{title.lower().replace(' ', '_').replace('-', '_')}.md": subject(title)
        for title in SECTIONS
    }
    lines = ["# API", "", "All names but modules are imported from `bouncing_disk_ros`.", ""]
    lines += ["| page | names |", "|---|---|"]
    for page, (title, (_, names)) in zip(pages, SECTIONS.items(), strict=True):
        lines.append(f"| [{title}]({page}) | {' '.join(f'`{name}`' for name in names.split())} |")
    toctree = ["```{toctree}", ":hidden:", "", *pages, "```", ""]
    return {"api.md": "\n".join([*lines, "", *toctree])} | pages


def subject(title: str) -> str:
    """The page of one subject of the API."""
    about, names = SECTIONS[title]
    lines = [f"# {title}", "", " ".join(about.split()), ""]
    for name in names.split():
        if name in MODULES:
            lines += [f"## bouncing_disk_ros.{name}", ""]
            lines += [line for one in MODULES[name] for line in directive(f"{name}.{one}")]
        else:
            places = NEED_ROS if name == "SimulatorNode" else (name,)
            lines += [line for place in places for line in directive(place)]
    return "\n".join(lines)


def fields_of(one: Any) -> dict[str, str]:
    """Fields of a class -> what the comments behind them say."""
    try:
        lines = inspect.getsourcelines(one)[0]
    except (OSError, TypeError):
        return {}
    return {match[1]: match[2] for line in lines if (match := _FIELD.match(line.rstrip()))}


def as_rst(_: Sphinx, kind: str, _name: str, one: Any, _options: Any, lines: list[str]) -> None:
    """Make reStructuredText of a docstring: names in backquotes are code, all else is text."""
    if kind == "class" and (fields := fields_of(one)):
        lines += ["", *(f"- `{name}`: {what}" for name, what in fields.items()), ""]
    lines[:] = [
        line if line.lstrip().startswith((">>>", "...")) else escaped(line) for line in lines
    ]


def escaped(line: str) -> str:
    """One line of text without marks of reStructuredText but for `code`."""
    parts = re.split(r"(`[^`]+`)", line)
    for i, part in enumerate(parts):
        # a mark needs a backslash: bars, stars, and an underscore that ends a word
        parts[i] = f"`{part}`" if i % 2 else re.sub(r"([|*\\]|_\b(?!\w))", r"\\\1", part)
    return "".join(parts)


def shortened(*event: Any) -> tuple[str, str] | None:
    """A signature with the names of types alone."""
    signature, returned = event[-2:]
    if signature is None:
        return None
    return re.sub(r"~[\w.]+\.", "", signature).replace("<factory>", "..."), returned or ""


def skipped(*event: Any) -> bool | None:
    """Whether to leave a member out: a field, which the text of its class lists."""
    return True if type(event[3]).__name__ in ("_tuplegetter", "member_descriptor") else None


def build(folder: Path) -> bool:
    """Make the pages in folder/html; whether there was no warning."""
    source = folder / "source"
    shutil.rmtree(folder, ignore_errors=True)
    source.mkdir(parents=True)
    copy_guides(source)
    (source / "index.md").write_text(index(), "utf-8")
    for name, text in api().items():
        (source / name).write_text(text, "utf-8")
    html, cache = str(folder / "html"), str(folder / "cache")
    app = Sphinx(str(source), None, html, cache, "html", SETTINGS, status=None, warningiserror=True)
    app.connect("autodoc-process-docstring", as_rst)
    app.connect("autodoc-process-signature", shortened)
    app.connect("autodoc-skip-member", skipped)
    app.build()
    return app.statuscode == 0


def main() -> int:
    """Build; exit code 0 done, 1 failed."""
    folder = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "output" / "docs"
    if not build(folder):
        return ExitCode.FAILED
    print(folder / "html" / "index.html")
    return ExitCode.DONE


if __name__ == "__main__":
    sys.exit(main())
