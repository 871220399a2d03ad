"""The executable `perform`: publish a programme of platform motions and see it carried out."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from bouncing_disk_ros import environment
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.stop import Stop
from bouncing_disk_ros.run.programmes import load_programme, programme_names

_ABOUT = """Publish a programme of platform motions on platform/command as one message, wait until
the platform has carried it out, and end."""
_EXAMPLE = "ros2 run bouncing_disk_ros perform first_toss_to_period_1"

_SPECS = (
    Spec("programme", "", "", "name of a programme of the package, or the path of a YAML file; "
         "may also be given as the first argument"),
    Spec("lead", 0.5, "s", "the programme starts at least this long after it is published", low=0.0,
         high=3600.0),
    Spec("timeout", 10.0, "s", "how long to wait for a simulator that listens", low=0.0, high=1e6),
)  # fmt: skip
OPTIONS = {spec.name: spec for spec in _SPECS}


def programme_lines() -> str:
    """The programmes of the package with what they do."""
    rows = [(name, load_programme(name).description) for name in programme_names()]
    width = max((len(name) for name, _ in rows), default=0)
    return "programmes:\n" + "\n".join(f"  {name:{width}}  {text}" for name, text in rows)


def main(args: Sequence[str] | None = None) -> int:
    """Perform a programme; exit code 0 done, 1 nobody listened or obeyed, 2 bad input, 130."""
    argv = list(sys.argv[1:] if args is None else args)
    stop = Stop().install()
    environment.prepare()
    stop.importing = True
    from bouncing_disk_ros.nodes.performer import Performer
    from bouncing_disk_ros.nodes.tool import own_arguments, parser_of, run_tool

    stop.importing = False
    own = own_arguments(argv)
    parser = parser_of("perform", _ABOUT, OPTIONS, _EXAMPLE)
    parser.usage = "perform [PROGRAMME] [--help] [--ros-args -p NAME:=VALUE ...]"
    parser.add_argument("programme", nargs="?", default="", metavar="PROGRAMME",
                        help="name of a programme, or the path of a YAML file")  # fmt: skip
    parser.epilog = f"{programme_lines()}\n\n{parser.epilog}"
    given = parser.parse_args(own).programme
    return run_tool(
        "perform",
        argv[len(own) :],
        lambda: Performer(OPTIONS, given),
        lambda node: node.perform(stop),
        stop,
    )


if __name__ == "__main__":
    sys.exit(main())
