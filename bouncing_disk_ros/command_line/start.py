"""The begin and end of an executable: signals, surroundings, command line, exit code.

`Start` is made first of all in a `main`. Loads neither rclpy nor numba: --help and a wrong argument
are answered at once. Before it `option_values` turns given options into values.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import NoReturn

from bouncing_disk_ros.command_line import environment
from bouncing_disk_ros.command_line.ros_arguments import Overrides, RosArguments
from bouncing_disk_ros.command_line.stdout import prepare_stdout
from bouncing_disk_ros.command_line.stop import Answer, Stop
from bouncing_disk_ros.errors import (
    BagError,
    ExitCode,
    FailedError,
    InputError,
    closest,
    one_line,
)
from bouncing_disk_ros.help_text import spec_lines
from bouncing_disk_ros.parameters import TABLE, Spec, Value, is_rclpy_parameter

FIGURE_KINDS = ("png", "pdf", "svg")


def figure_kinds(text: str) -> list[str]:
    """The kinds of figure files named in a text; none for an empty one or "none"."""
    kinds = text.replace(",", " ").lower().split()
    if kinds == ["none"]:
        return []
    for kind in kinds:
        if kind not in FIGURE_KINDS:
            allowed = "any of " + ", ".join(FIGURE_KINDS) + ", or none"
            raise InputError("figures", text, allowed, closest(kind, FIGURE_KINDS))
    return list(dict.fromkeys(kinds))


def check_figure_file(option: str, file: Path) -> None:
    """Raise InputError, naming the option, where a file name ends with no kind of figure."""
    if file.suffix[1:] not in FIGURE_KINDS:
        endings = [f".{kind}" for kind in FIGURE_KINDS]
        allowed = f"a file ending in {', '.join(endings)}"
        raise InputError(option, str(file), allowed, closest(file.suffix, endings))


def option_values(given: Mapping[str, object], table: Mapping[str, Spec]) -> dict[str, Value]:
    """The values of a table's options; unknown names and wrong values are InputErrors.

    `given`: parameter overrides.
    """
    for name in given:
        if name not in table and not is_rclpy_parameter(name):
            hint = closest(name, table) or "--help lists the parameters."
            if name in TABLE and "preset" in table:
                hint = "The simulator has it: give a preset with -p preset:=FILE."
            raise InputError("parameter", name, ", ".join(table), hint)
    return {name: spec.checked(given.get(name, spec.default)) for name, spec in table.items()}


class Start:
    """The begin and end of an executable; made first of all in its `main`.

    `table`: of its parameters; None: it takes no ROS arguments. `args`: the command line, None for
    that of the process. `code`: what a signal ends it with. `overrides`: the parameters it gives,
    once it is parsed. `needs_ros`: whether it ends, with one line and exit code 2, where ROS is not
    installed. `node_name`: of its node, where that has another name.
    """

    def __init__(
        self,
        name: str,
        about: str,
        table: Mapping[str, Spec] | None,
        example: str,
        args: Sequence[str] | None,
        code: ExitCode = ExitCode.DONE,
        *,
        needs_ros: bool = True,
        node_name: str = "",
    ) -> None:
        self.name = name
        self._node_name = node_name or name
        self._takes_ros, self._needs_ros = table is not None, needs_ros
        self.stop = Stop(name, code).install()
        prepare_stdout()
        environment.prepare(uses_ros=self._takes_ros)
        argv = list(sys.argv[1:] if args is None else args)
        at = argv.index("--ros-args") if "--ros-args" in argv else len(argv)
        self._own, self.ros = argv[:at], argv[at:]
        self.overrides: Overrides = {}
        self.parser = parser_of(name, about, table, example)

    def parse(self) -> argparse.Namespace:
        """What stands before --ros-args; ends the process for --help and for what is wrong."""
        given = self.parser.parse_intermixed_args(self._own)
        if not self._takes_ros:
            return given
        if self._needs_ros and not environment.ros_is_here():
            why = "needs ROS 2, and rclpy or its message packages are not installed here"
            how = "pip install '.[ros]' installs them on x86-64 Linux (docs/installation.md)"
            self._refuse(f"{why}. {how}")
        try:
            arguments = RosArguments(self.ros, self._node_name)
        except InputError as error:
            self._refuse(error.line)
        self.overrides = arguments.overrides
        for file in arguments.unused_files:  # ROS ignores these without a word
            why = f"it sets nothing for a node called {arguments.node_name}, and is ignored"
            print(f"{self.name}: --params-file {file}: {why}", file=sys.stderr, flush=True)
        return given

    def _refuse(self, line: str) -> NoReturn:
        """End the process with one line and exit code 2."""
        print(f"{self.name}: {line}", file=sys.stderr, flush=True)
        raise SystemExit(int(ExitCode.BAD_INPUT))

    def run(self, work: Callable[[], int], path: str = "", unfinished: str = "") -> int:
        """Do the work of the executable; the exit code. Every error is one line on stderr.

        A signal raises KeyboardInterrupt, unless the work sets another answer. `path`: of the file
        or bag worked on, named where an error does not name it. `unfinished`: what is said besides
        of work that is interrupted.
        """
        self.stop.answer = Answer.INTERRUPT
        try:
            return work()
        except InputError as error:
            code, line = ExitCode.BAD_INPUT, error.line
        except FailedError as error:
            code, line = ExitCode.FAILED, str(error)
        except (BagError, OSError) as error:
            code = ExitCode.BAD_INPUT if isinstance(error, BagError) else ExitCode.FAILED
            line = str(error) if path in str(error) else f"{path}: {error}"
        except KeyboardInterrupt:
            # One that has passed through exec() of a text, as rosbags and dataclasses use it, makes
            # CPython end by SIGINT whatever the exit code, until another text has been run.
            exec("")  # noqa: S102
            self.stop.say(unfinished)
            return self.stop.code
        print(f"{self.name}: {one_line(line)}", file=sys.stderr, flush=True)
        return code


_AS_WRITTEN = argparse.RawDescriptionHelpFormatter


class _Parser(argparse.ArgumentParser):
    """A parser that says where parameters belong."""

    def error(self, message: str) -> NoReturn:
        """End the process with one line and exit code 2."""
        if "unrecognized arguments" in message and "=" in message:
            message += ". Parameters come after --ros-args: --ros-args -p NAME:=VALUE"
        super().error(message)


def parser_of(
    name: str, about: str, table: Mapping[str, Spec] | None, example: str
) -> argparse.ArgumentParser:
    """The parser of an executable; --help shows its options from the table."""
    title = "examples" if "\n" in example else "example"
    epilog = f"{title}:\n  {example}"
    if table is None:
        return argparse.ArgumentParser(
            prog=name, description=about, epilog=epilog, formatter_class=_AS_WRITTEN
        )
    lines = chain.from_iterable(map(spec_lines, table.values()))
    return _Parser(
        prog=name,
        description=about,
        usage=f"{name} [--help] [--ros-args -p NAME:=VALUE ... -r __ns:=/NAMESPACE ...]",
        epilog="\n".join(["parameters (--ros-args -p NAME:=VALUE):", *lines, "", epilog]),
        formatter_class=_AS_WRITTEN,
    )
