"""The package against an independent second method (reference.inclusion): all features at once.

Random scripts of g + P/m from 1e-9 to 1e9 m/s², with loads, cross-fades, offset trajectories,
impulses, parameters, resets and snapshots at any instant, at decimal ones and at those of events.
`make soak` has 10⁵ of them, and replays each.
"""

from __future__ import annotations

import pytest

from bouncing_disk_ros.core.model import ImpactKind
from reference import inclusion
from reference.cases import FIRST, examples
from support.random_runs import Script, random_script
from support.scripted import compare, judge, judge_scripts, play

PART = 400
SCRIPTS = examples(PART, 100_000)
pytestmark = pytest.mark.timeout(600)  # compiled, on a machine that does much else
LEAST_COMPARED = 0.95
"""Of all samples: chaos must not swallow the comparison."""


@pytest.mark.parametrize("first", range(FIRST, FIRST + SCRIPTS, PART))
def test_random_scripts_agree_with_the_second_method(first: int) -> None:
    seeds = range(first, first + PART)
    found = judge_scripts(seeds, replay_every=4 if SCRIPTS == PART else 1)
    assert found.differences == []
    samples = sum(len(random_script(seed).samples_ns) for seed in seeds)
    assert found.samples > LEAST_COMPARED * samples
    assert found.impacts > 4 * PART


@pytest.mark.parametrize("column", ["gap", "angle", "loss in sliding", "axial loss of impacts"])
def test_a_wrong_state_is_found(column: str) -> None:
    """A change of 1e-8 in one number of a run without chaos."""
    script = _quiet()
    played = play(script)
    assert compare(script, played).differences == []
    place = ["gap", "relative speed", "angle", "angular velocity", "loss in the brake",
             "loss in sliding", "axial loss of impacts"].index(column)  # fmt: skip
    last = int(abs(played.states[:, place]).argmax())
    played.states[last, place] *= 1.0 + 1e-8
    assert [one.what.split(" at ")[0] for one in compare(script, played).differences] == [column]


def test_a_missing_impact_is_found() -> None:
    script = _quiet()
    played = play(script)
    assert played.rows[0]["kind"] == ImpactKind.IMPACT
    found = compare(script, played._replace(rows=played.rows[1:])).differences
    assert found[0].what == "time of impact"


@pytest.mark.parametrize("seed", [1579, 2994, 2902, 701016, 700366, 2059621, 2010441])
def test_events_within_rounding_of_an_instant_are_no_difference(seed: int) -> None:
    """Impacts of 3e-16 m/s at the start, of 7e-15 m/s at a chatter's end; an impulse and a sample
    at the instant of these; a rest on a knot; a chatter that ends at an input's instant.
    """
    assert judge(random_script(seed)).differences == []


@pytest.mark.parametrize("seed", [901315, 906723, 2018013, 2008649])
def test_the_second_method_decides_ties(seed: int) -> None:
    """A brake as strong as the friction: slips whose drive balances over a step, speeds that only
    rounding gives, a platform that turns about where it is slow; a brake that comes later.
    """
    assert judge(random_script(seed)).differences == []


def _quiet() -> Script:
    """The first script with all of these, and no reset."""
    for seed in range(100):
        script = random_script(seed)
        start = script.motion, script.disk, script.initial
        path = inclusion.integrate(start, script.inputs, script.samples_ns)
        used = abs(path.states[:, [0, 2, 5, 6]]).max(axis=0) > 0.0
        if used.all() and not any(one.kind == "reset" for one in script.inputs):
            return script
    raise AssertionError("no such script")
