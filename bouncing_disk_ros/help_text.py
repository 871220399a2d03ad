"""The tables of parameters, topics, services and exit codes as text: for --help and for docs/.

`python -m bouncing_disk_ros.help_text docs` writes docs/parameters.md and the tables of
docs/interfaces.md and docs/recording.md again.
"""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.executables import STUDIES, loaded, module_of
from bouncing_disk_ros.parameters import GROUPS, SLOWEST, TABLE, Spec
from bouncing_disk_ros.topics import LOCKSTEP_TOPICS, SERVICES, TOPICS, TRANSFORM_TOPICS

BEGIN = "<!-- tables: written by `python -m bouncing_disk_ros.help_text docs` -->"
END = "<!-- end of tables -->"
LIMITS_BEGIN = "<!-- limits: written by `python -m bouncing_disk_ros.help_text docs` -->"
LIMITS_END = "<!-- end of limits -->"
EXIT_MEANINGS = {
    ExitCode.DONE: "done; also a node ended by Ctrl-C or SIGTERM",
    ExitCode.FAILED: "failed for another reason than the input",
    ExitCode.BAD_INPUT: "bad input: a parameter, command line, preset, file or environment",
    ExitCode.REPLAY_DIFFERS: "a replay differs from the record",
    ExitCode.INTERRUPTED: "a study was interrupted",
}


def default_text(spec: Spec) -> str:
    """The default as it would be typed."""
    if isinstance(spec.default, bool):
        return str(spec.default).lower()
    return f"'{spec.default}'" if isinstance(spec.default, str) else f"{spec.default:.10g}"


def _wrapped(head: str, text: str) -> list[str]:
    return [f"  {head}", *textwrap.wrap(text, 92, initial_indent="      ",
                                        subsequent_indent="      ")]  # fmt: skip


def spec_lines(spec: Spec) -> list[str]:
    """One parameter, for a terminal."""
    fixed = ", only at start" if spec.read_only else ""
    fixed = ", only while unconfigured" if spec.while_unconfigured else fixed
    default = f"{default_text(spec)} {spec.shown_unit}".rstrip()
    head = f"{spec.name} ({spec.type_name}, default {default}{fixed})"
    allowed = f"; {spec.allowed}" if spec.type in (int, float) else ""
    return _wrapped(head, f"{spec.description}{allowed}")


def parameter_lines() -> list[str]:
    """One entry for each parameter, for a terminal."""
    lines: list[str] = []
    for group, title in GROUPS.items():
        lines.append(f" {title}:")
        for spec in (spec for spec in TABLE.values() if spec.group == group):
            lines += spec_lines(spec)
    lines.append(" Example: --ros-args -p preset:=pizza_multiple_toss -p restitution:=0.4")
    return lines


def topic_lines() -> list[str]:
    """One entry for each topic, for a terminal."""
    lines: list[str] = []
    for topic in (*TOPICS.values(), *TRANSFORM_TOPICS.values(), *LOCKSTEP_TOPICS.values()):
        lines += _wrapped(f"{topic.direction:3} {topic.name}  {topic.type}", topic.meaning)
    lines.append(f" Example: {TOPICS['platform/axial_amplitude'].example}")
    return lines


def service_lines() -> list[str]:
    """One entry for each service, for a terminal."""
    lines: list[str] = []
    for service in SERVICES.values():
        lines += _wrapped(f"{service.name}  {service.type}", service.meaning)
    lines.append(f" Example: {SERVICES['~/pause'].example}")
    return lines


_PAGE_HEAD = """# Parameters

This page has the parameters of the simulator first, then the parameters of the
[studies](studies.md). [model.md](model.md#units-symbols-names) explains the symbols.

<!-- Written by `python -m bouncing_disk_ros.help_text docs` from the tables of the package. -->

Give a parameter at start with `--ros-args -p name:=value`, in a preset, or in a parameter file
under `/**:`. While the node runs, change it with `ros2 param set /bouncing_disk name value`.

- Parameters marked *start* cannot be changed while the node runs. Parameters marked
  *unconfigured* can be changed only before the node is configured, or after it is cleaned up.
- A wrong value is refused with one line and changes nothing.
- An integer is accepted for a double, and a part of π for an angle: `-p phase_lag:=0.25pi`.
- The ranges of sliders in graphical tools are narrower than the allowed ranges, and grow with the
  value.
- Parameters of the platform's motion and of the initial state act at the next `~/reset` (the
  answer to a change says so). To change the motion now, command the platform."""


def parameters_page() -> str:
    """docs/parameters.md, generated from the table."""
    parts = [_PAGE_HEAD]
    for group, title in GROUPS.items():
        rows = [
            f"## {title}",
            _HEAD + "\n".join(_row(spec) for spec in TABLE.values() if spec.group == group),
        ]
        parts += rows
    parts.append(
        "Rules between parameters: `preload` > −`mass` × `gravity`; `initial_axial_velocity` other "
        "than 0 needs `initial_with_platform` false; `real_time_factor` is 0 or at least "
        f"{SLOWEST:g}. No two frames have the same name. Names have no spaces and do not begin "
        "with /. Platform and disk each have a second frame, whose name ends in `_carriage`."
    )
    return "\n\n".join(parts + _study_parts()) + "\n"


def _study_parts() -> list[str]:
    """The studies' tables; their definitions belong to no table, so they are loaded by name."""
    definitions = [loaded(f"{module_of(name)}:DEFINITION") for name in STUDIES]
    parts = []
    for one in definitions:
        parts += [f"## The study {one.name}", _HEAD + "\n".join(map(_row, one.specs))]
    *bags, last = (f"`{one.name}`" for one in definitions if one.takes_run)
    note = (
        "Results do not depend on these parameters, except that a bag or a preset provides values "
        f"of the parameters above. Only {', '.join(bags)} and {last} take them."
    )
    common = loaded("bouncing_disk_ros.study.shared_options:COMMON")
    return [*parts, "## All studies", note, _HEAD + "\n".join(map(_row, common.values()))]


_HEAD = (
    "| name | symbol | type | default | unit | allowed | meaning | source |\n"
    "|---|---|---|---|---|---|---|---|\n"
)


def _row(spec: Spec) -> str:
    mark = " *start*" if spec.read_only else " *unconfigured*" if spec.while_unconfigured else ""
    name = f"`{spec.name}`{mark}"
    cells = (name, spec.symbol, spec.type_name, default_text(spec), spec.shown_unit, spec.allowed,
             spec.description, spec.source)  # fmt: skip
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def topics_table() -> str:
    """The topics and services as Markdown tables."""
    rows = [
        f"| {topic.direction} | `{topic.name}` | {topic.type} | {topic.qos} | {topic.meaning} |"
        for topic in (*TOPICS.values(), *TRANSFORM_TOPICS.values(), *LOCKSTEP_TOPICS.values())
    ]
    calls = [f"| `{row.name}` | {row.type} | {row.meaning} |" for row in SERVICES.values()]
    codes = [f"| {code.value} | {EXIT_MEANINGS[code]} |" for code in ExitCode]
    return "\n".join(
        [
            "| | topic | type | quality of service | meaning |\n|---|---|---|---|---|", *rows, "",
            "| service | type | meaning |\n|---|---|---|", *calls, "",
            "| exit code | meaning |\n|---|---|", *codes,
        ]
    )  # fmt: skip


def with_table(page: str, begin: str, table: str, end: str) -> str:
    """A page with what lies between two marks replaced by a table."""
    head, _, rest = page.partition(f"{begin}\n")
    _, _, tail = rest.partition(f"{end}\n")
    return f"{head}{begin}\n\n{table}\n\n{end}\n{tail}"


def with_limits(page: str, home: str) -> str:
    """A page with the current limits of a home (`limits.FILES_READ` or `limits.MESSAGES`)."""
    return with_table(page, LIMITS_BEGIN, limits.table(home), LIMITS_END)


def main(folder: str) -> None:
    """Write the generated page into a folder, and the tables into other pages there."""
    Path(folder, "parameters.md").write_text(parameters_page(), encoding="utf-8")
    interfaces, recording = Path(folder, "interfaces.md"), Path(folder, "recording.md")
    page = with_table(interfaces.read_text(encoding="utf-8"), BEGIN, topics_table(), END)
    interfaces.write_text(with_limits(page, limits.MESSAGES), encoding="utf-8")
    page = recording.read_text(encoding="utf-8")
    recording.write_text(with_limits(page, limits.FILES_READ), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "docs")
