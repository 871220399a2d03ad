"""Compute every figure of the paper, and write docs/figures.md with each number beside the paper's.

    python tools/make_figures.py [NAME ...]      (default: all; geometry: that of docs/model.md)

The studies run by the parameter files in config/; their stores are kept in output/figures, so that
a second run only draws, and an interrupted one goes on.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from bouncing_disk_ros.command_line.stop import Answer, Stop
from bouncing_disk_ros.errors import ExitCode, InputError
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.study import run
from bouncing_disk_ros.study.by_name import definition_of
from geometry_figure import geometry_figure  # beside this file
from paper_figures import FIGURES, PaperFigure, page

if TYPE_CHECKING:
    import xarray as xr

    from bouncing_disk_ros.study.definition import StudyDefinition

ROOT = Path(__file__).resolve().parents[1]
DPI = 110


def tool_and_values(name: str) -> tuple[StudyDefinition, dict[str, Value]]:
    """The study of a parameter file in config/ and its whole set of parameters, checked."""
    content = yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text("utf-8"))
    ((key, section),) = content.items()
    definition = definition_of(key.rsplit("/", 1)[-1])
    given = section["ros__parameters"]
    for field in given:
        if field not in definition.table:
            raise InputError(f"config/{name}.yaml", field, ", ".join(definition.table))
    values = {
        spec.name: spec.checked(given.get(spec.name, spec.default)) for spec in definition.specs
    }
    return definition, values


def compute(figure: PaperFigure, stop: Stop) -> xr.Dataset | None:
    """The result of one figure, its pictures written to docs/figures; None: interrupted."""
    definition, values = tool_and_values(figure.name)
    study = definition.make(values)
    store = ROOT / "output" / "figures" / f"{figure.name}.zarr"
    result = run(study, store, stopped=lambda: stop.asked)
    if result is not None:
        folder = ROOT / "docs" / "figures"
        for name, picture in definition.pictures(study, result).items():
            picture.savefig(folder / f"{figure.name}_{name}.png", dpi=DPI)
            print(f"docs/figures/{figure.name}_{name}.png", flush=True)
    return result


def main() -> int:
    """Compute, draw, write the page; exit code 0 done, 2 bad input, 130 interrupted."""
    names = [figure.name for figure in FIGURES]
    parser = argparse.ArgumentParser(prog="make_figures", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"any of geometry, {', '.join(names)}"
    )
    given = parser.parse_args().names
    if "geometry" in given or not given:
        geometry_figure().savefig(ROOT / "docs" / "figures" / "geometry.png", dpi=DPI)
        print("docs/figures/geometry.png", flush=True)
    chosen = [name for name in given if name != "geometry"] if given else names
    stop = Stop().install()
    stop.answer = Answer.NOTE
    results = {}
    try:
        for name in chosen:
            if name not in names:
                raise InputError("NAME", name, ", ".join(names))
            figure = FIGURES[names.index(name)]
            result = compute(figure, stop)
            if result is None:
                print("interrupted; the same command goes on from here", file=sys.stderr)
                return ExitCode.INTERRUPTED
            results[name] = result
    except InputError as error:
        print(f"make_figures: {error.line}", file=sys.stderr)
        return ExitCode.BAD_INPUT
    if chosen == names:
        (ROOT / "docs" / "figures.md").write_text(page(results), encoding="utf-8")
        print("docs/figures.md", flush=True)
    return ExitCode.DONE


if __name__ == "__main__":
    sys.exit(main())
