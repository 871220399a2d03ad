"""The executable `perform`: publish a programme of platform motions, wait for its end."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.folders import share_directory
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.run.presets import read_yaml_file

_ABOUT = """Publish a programme of platform motions on platform/command as one message, wait until
the platform has followed it, and end."""
_EXAMPLE = "ros2 run bouncing_disk_ros perform first_toss_to_period_1"

_SPECS = (
    Spec("programme", "", "", "name of a programme of the package, or the path of a YAML file; "
         "may also be given as the first argument"),
    Spec("lead", 0.5, "s", "the programme starts at least this long after it is published", low=0.0,
         high=3600.0),
    Spec("timeout", 10.0, "s", "how long to wait for a simulator", low=0.0, high=1e6),
)  # fmt: skip
OPTIONS = {spec.name: spec for spec in _SPECS}


def programme_lines() -> str:
    """The programmes of the package with what they do, by their files alone."""
    files = sorted((share_directory() / "config" / "programmes").glob("*.yaml"))
    texts = [read_yaml_file("programme", file.stem, file)["description"] for file in files]
    rows = [(file.stem, " ".join(text.split())) for file, text in zip(files, texts, strict=True)]
    width = max((len(name) for name, _ in rows), default=0)
    return "programmes:\n" + "\n".join(f"  {name:{width}}  {text}" for name, text in rows)


def main(args: Sequence[str] | None = None) -> int:
    """Perform a programme; exit code 0 done, 1 nobody listened or obeyed, 2 bad input, 130."""
    start = Start("perform", _ABOUT, OPTIONS, _EXAMPLE, args, ExitCode.INTERRUPTED)
    parser = start.parser
    parser.usage = "perform [PROGRAMME] [--help] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("programme", nargs="?", default="", metavar="PROGRAMME",
                        help="name of a programme, or the path of a YAML file")  # fmt: skip
    parser.epilog = f"{programme_lines()}\n\n{parser.epilog}"
    given = start.parse().programme
    with start.stop.loading():
        from bouncing_disk_ros.nodes.performer import Performer
        from bouncing_disk_ros.ros.spin import run_node

    return run_node(start, partial(Performer, OPTIONS, given), Performer.perform)
