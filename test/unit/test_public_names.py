"""What a user calls: found by name and by dir(), with a repr; numbers of NumPy are numbers."""

from __future__ import annotations

import ast
import doctest
import importlib.util
import inspect
import io
import math
import pickle
import re
import runpy
import sys
import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.image import imread

import bouncing_disk_ros
from bouncing_disk_ros import (
    NEED_ROS,
    InputError,
    NextCollisionMap,
    bag,
    find_attractors,
    fixed_point,
    plots,
    run_study,
    simulate,
    study,
)
from bouncing_disk_ros.field_checks import plain
from bouncing_disk_ros.parameters import TABLE, listed_text
from bouncing_disk_ros.study import Arrays, Study, named
from bouncing_disk_ros.study.by_name import definition_of
from reference.cases import in_soak
from support.checks import refused, there
from support.impact_sounds import drop_times, sound_of
from support.studies import SMALLEST

SMALL: dict[str, Any] = {"axial_forcing": 0.34, "width": 16, "height": 12}


def test_dir_lists_what_is_public_and_says_what_it_is() -> None:
    shown = [name for name in dir(bouncing_disk_ros) if not name.startswith("__")]
    assert sorted({*shown, "__version__"}) == sorted([*bouncing_disk_ros.__all__, *NEED_ROS])
    for module in (plots, study):
        assert {name for name in dir(module) if not name.startswith("_")} >= set(module.__all__)
    for name in set(bouncing_disk_ros.__all__) - {"__version__"}:
        assert len((getattr(bouncing_disk_ros, name).__doc__ or "").strip()) > 20, name


def test_each_name_that_a_stub_imports_is_public() -> None:
    for module in (bouncing_disk_ros, plots, study):
        tree = ast.parse(Path(str(module.__file__)).with_suffix(".pyi").read_text("utf-8"))
        found = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
        declared = {name.asname for node in found for name in node.names if name.asname}
        assert declared <= {*dir(module)}


FUNCTIONS = {
    f"{module.__name__}.{name}": getattr(module, name)
    for module in (bouncing_disk_ros, plots, study, bag)
    for name in module.__all__
    if inspect.isfunction(getattr(module, name))
}


@pytest.fixture
def example_folder(tmp_path: Path) -> Path:
    """A folder with the files that examples name: a bag, a sound of a ball, a stored result."""
    script = Path(__file__).resolve().parents[2] / "examples" / "make_bag.py"
    runpy.run_path(str(script))["make_bag"](str(tmp_path / "run_1"), 20.0)
    times = drop_times(rng := np.random.default_rng(1), 0.8, 0.5, 0.05)
    levels = np.array([0.8**n for n in range(len(times))])
    sound = sound_of(rng, times, levels, rate=48e3, frequency=3000.0, decay=0.003, noise=1e-3)
    with wave.open(str(tmp_path / "drop.wav"), "wb") as file:
        file.setparams((1, 2, 48_000, 0, "NONE", ""))
        file.writeframes((16_000 * sound.samples).astype("<i2").tobytes())
    bouncing_disk_ros.basins(tmp_path / "small.zarr", axial_forcing=0.34, width=24, height=24)
    return tmp_path


def test_there_is_an_example_of_each_public_function() -> None:
    assert len(FUNCTIONS) > 50
    for name, function in FUNCTIONS.items():
        assert doctest.DocTestParser().get_examples(str(function.__doc__)), name


DRAWING = [name for name in FUNCTIONS if ".plots." in name or name.endswith(".figures")]
"""Functions whose examples draw the results of other functions' examples."""


EXAMPLES = [*sorted(set(FUNCTIONS) - set(DRAWING)), *in_soak(*DRAWING)]


def test_the_examples_of_public_functions_run(
    example_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder with the files that they name, and with all public names."""
    monkeypatch.chdir(example_folder)
    with bag.open("run_1") as run:
        cloud = next(run.decoded(["/disk/impacts"]))[1]
    known: dict[str, Any] = {"np": np, "Path": Path, "bag": bag, "cloud": cloud}
    for module in (study, plots, bouncing_disk_ros):
        known |= {public: getattr(module, public) for public in module.__all__}
    hears = importlib.util.find_spec("soundfile") is not None
    for name in (one for one in EXAMPLES if hears or "impact_times" not in one):
        names = dict(known)
        for example in doctest.DocTestParser().get_examples(str(FUNCTIONS[name].__doc__)):
            try:
                exec(compile(example.source, name, "single"), names)
            except Exception as error:
                error.add_note(f"example of {name}")
                raise


def test_the_docstring_of_simulate_names_each_parameter_in_its_group() -> None:
    text = str(simulate.__doc__)
    parts = dict(re.findall(r"- (Motion|Disk|Start): (.*?)(?=\n    - )", text, re.DOTALL))
    assert len(parts) == 3
    for group, part in parts.items():
        names = [spec.name for spec in TABLE.values() if spec.group == group.lower()]
        assert [name for name in re.findall(r"`(\w+)`", part) if name in TABLE] == names


def test_the_pages_of_the_api_have_a_place_for_each_name(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[2] / "tools"))
    pages = pytest.importorskip("make_docs")
    page = "\n".join(pages.api().values())
    for name in set(bouncing_disk_ros.__all__) - {"__version__", *pages.MODULES}:
        assert f":: bouncing_disk_ros.{name}\n" in page, name


def test_a_mistyped_name_gets_the_nearest() -> None:
    with pytest.raises(AttributeError, match="Did you mean simulate"):
        bouncing_disk_ros.simulat  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(AttributeError, match=r"no attribute 'basin_pict'\. Did you mean"):
        plots.basin_pict  # type: ignore[attr-defined]  # noqa: B018


# --- numbers of NumPy -----------------------------------------------------------------------------
def test_numbers_of_numpy_and_lists_of_them_are_numbers() -> None:
    given: dict[str, Any] = {
        "axial_forcing": np.float64(0.4),
        "width": np.int64(16),
        "height": np.array(12),
    }
    assert (
        named("basins", **given).parameters
        == named("basins", axial_forcing=0.4, width=16, height=12).parameters
    )
    assert type(named("basins", **given).parameters["axial_forcing"]) is float
    refused(r"width: got 2\.5", named, "basins", width=np.float64(2.5))
    refused("width: got True", named, "basins", width=np.bool_(True))
    text = named("toss_paths", phase_lags="0.0 0.5", amplitude_angles="0.7 0.8").parameters
    for lags in ([0.0, 0.5], (0.0, np.float64(0.5)), np.array([0.0, 0.5])):
        lists: dict[str, Any] = {"phase_lags": lags, "amplitude_angles": np.array([0.7, 0.8])}
        assert named("toss_paths", **lists).parameters == text
    assert listed_text("a") == plain("a") == "a"


def test_simulate_takes_numbers_of_numpy() -> None:
    plain_run = simulate(2.0, frequency=3.0, programme=[(1.0, {"axial_amplitude": 0.05})],
                         impulses=[(1.5, 0.01, 0.0)], sample_rate=10.0)  # fmt: skip
    run = simulate(np.float32(2.0), frequency=np.int64(3),
                   programme=[(np.float64(1.0), {"axial_amplitude": np.float64(0.05)})],
                   impulses=[(np.float64(1.5), np.float64(0.01), np.int32(0))],
                   sample_rate=np.int16(10))  # fmt: skip
    assert np.array_equal(run.impacts, plain_run.impacts)
    assert np.array_equal(run.samples, plain_run.samples)
    assert run.inputs == plain_run.inputs
    for wrong in (np.float64("nan"), np.bool_(True), np.array([1.0])):
        refused("duration", simulate, wrong)


# --- axial forcing --------------------------------------------------------------------------------
def test_axial_forcing_is_an_amplitude_wins_over_a_preset_and_not_over_one_that_is_given() -> None:
    result = simulate(1.0, axial_forcing=np.float64(0.45), frequency=4.0, gravity=9.81,
                      preload=0.5, mass=0.2)  # fmt: skip
    amplitude = float(result.parameters["axial_amplitude"])
    pull = 9.81 + 0.5 / 0.2
    assert amplitude * (math.tau * 4.0) ** 2 / (math.pi * pull) == pytest.approx(0.45, rel=1e-14)
    preset = simulate(1.0, preset="pizza_multiple_toss", axial_forcing=0.5).parameters
    own = simulate(1.0, preset="pizza_multiple_toss").parameters
    ratio = float(preset["axial_amplitude"]) / float(own["axial_amplitude"])
    assert ratio == pytest.approx(0.5 / 0.45, rel=1e-12)
    with pytest.raises(InputError, match="allowed: none with axial_amplitude"):
        simulate(1.0, axial_forcing=0.45, axial_amplitude=0.04)
    refused(r"axial_forcing: got -1\.0", simulate, 1.0, axial_forcing=-1.0)


# --- reprs ----------------------------------------------------------------------------------------
def test_reprs_are_one_short_line() -> None:
    section = NextCollisionMap(np.float64(0.5), np.float64(0.5))
    assert repr(section).startswith("NextCollisionMap(axial_forcing=0.5, restitution=0.5, phase")
    found = find_attractors(section, [(1.0, -1.3), (3.0, -0.1)])
    things = [
        section, found, found.found[0], fixed_point(0.45, 0.5), named("basins", **SMALL),
        simulate(1.0, axial_forcing=0.45),
    ]  # fmt: skip
    for thing in things:
        text = repr(thing)
        assert "\n" not in text
        assert len(text) < 500
        assert "array(" not in text
        assert " at 0x" not in text
    assert repr(fixed_point(0.45, 0.5)).startswith("<stable orbit of 1 impact(s) in 1 cycle: τ =")
    assert "16 forcing_phase" in repr(named("basins", **SMALL))


# --- studies as functions -------------------------------------------------------------------------
def test_a_study_runs_by_name_and_as_a_function_and_its_result_is_opened(tmp_path: Path) -> None:
    stored = there(run_study(named("basins", **SMALL), tmp_path / "r.zarr", workers=1))
    by_name = run_study("basins", **SMALL)
    sent = pickle.loads(pickle.dumps(bouncing_disk_ros.basins))  # as to a worker
    as_function = sent(**SMALL)
    assert by_name is not None
    for result in (by_name, as_function):
        assert result.identical(stored.load()), "kept in memory alone, with the same bits"
    run_study("basins", tmp_path / "mine" / "result.zarr", **SMALL)
    for path in (tmp_path / "mine", tmp_path / "mine" / "result.zarr"):
        assert study.open_result(path)["label"].shape == (12, 16)
    refused(f"path: got '{tmp_path}', allowed: the output folder", study.open_result, tmp_path)


def test_a_study_shows_its_progress_when_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bouncing_disk_ros.basins(tmp_path / "r.zarr", progress=True, **SMALL)
    assert "basins: 100%" in capsys.readouterr().err
    bouncing_disk_ros.basins(tmp_path / "r.zarr", **SMALL)  # stderr is no terminal
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("given", "parameters", "words"),
    [
        ("basin", {}, "study: got 'basin', allowed: .* Did you mean basins"),
        (3, {}, "study: got 3, allowed: the name of a study, or what named"),
        ("basins", {"widht": 3}, "Did you mean width"),
        ("basins", {"workers": -1}, "workers: got -1"),
    ],
)
def test_what_cannot_be_run_is_told(given: object, parameters: dict[str, int], words: str) -> None:
    with pytest.raises(InputError, match=words):
        run_study(given, **parameters)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="allowed: none with a study that has its own"):
        run_study(named("basins", **SMALL), width=3)


@pytest.mark.parametrize("name", SMALLEST)
def test_every_variable_of_a_result_has_a_unit_and_a_name(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    made = named(name, **SMALLEST[name])
    finish, found = type(made).finish, list[xr.Dataset]()

    def finished(self: Study, result: xr.Dataset, context: Arrays) -> xr.Dataset:
        found.append(finish(self, result, context))
        return found[0]

    monkeypatch.setattr(type(made), "finish", finished)
    result = there(bouncing_disk_ros.run_study(name, **SMALLEST[name]))
    for key, variable in found[0].variables.items():
        assert {"units", "long_name"} <= variable.attrs.keys(), f"the study does not describe {key}"
    if name == "juggling":
        assert result["captured"].attrs["long_name"] == "part of the starts that was captured"
        assert result["median_time"].attrs["long_name"].startswith("median time")
    assert definition_of(name).lines(result)
    sent = pickle.loads(pickle.dumps(made))  # as to a worker
    assert (sent.parameters, sent.sequential) == (made.parameters, made.sequential)


def test_axes_are_called_by_their_parameter() -> None:
    result = bouncing_disk_ros.bifurcation(**SMALLEST["bifurcation"])
    assert np.array_equal(result["restitution"], result["value"])
    assert float(result.sel(restitution=0.551, method="nearest")["restitution"]) == 0.55
    shares = bouncing_disk_ros.basin_shares(**SMALLEST["basin_shares"])
    assert float(shares.sel(axial_forcing=0.4)["axial_forcing"]) == 0.4


def test_a_notebook_shows_a_figure_without_pyplot() -> None:
    result = bouncing_disk_ros.basins(**SMALL)
    picture = plots.basins_picture(result)
    assert imread(io.BytesIO(picture._repr_png_())).std() > 0.01  # type: ignore[attr-defined]
    assert "matplotlib.pyplot" not in sys.modules or "pyplot" not in str(type(picture))


# --- figures --------------------------------------------------------------------------------------
def test_a_result_is_drawn_as_its_command_draws_it(tmp_path: Path) -> None:
    result = there(run_study("basins", angular_velocities=[0.0, 1.0], **SMALL))
    drawn = bouncing_disk_ros.figures(result)
    assert list(drawn) == ["basins", "mean_speeds"]
    study.export(result, tmp_path / "result.nc")
    with xr.open_dataset(tmp_path / "result.nc") as opened:
        again = bouncing_disk_ros.figures(opened.load())
    for name, figure in drawn.items():
        shown = []
        for one in (figure, again[name]):
            one.set_layout_engine("none")  # takes three times as long as the rest
            one.savefig(content := io.BytesIO(), format="png", dpi=30)
            shown.append(content.getvalue())
        assert shown[0] == shown[1]


def test_what_is_no_result_of_a_study_is_not_drawn() -> None:
    with pytest.raises(InputError, match="result: got 'Dataset without the name of a study'"):
        bouncing_disk_ros.figures(xr.Dataset())
    with pytest.raises(InputError, match="result: got 'Result without the name of a study'"):
        bouncing_disk_ros.figures(simulate(0.0))  # type: ignore[arg-type]
