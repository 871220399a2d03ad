"""When cross-fades begin and end."""

from __future__ import annotations

from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.core.schedule import Fade, Impulse, add_impulse, plan_fades

SLOW, FAST = Motion(1, 1, 2.0, 0), Motion(1, 1, 10.0, 0)
MS = 10**6


def test_a_fade_begins_one_period_of_the_slower_motion_before_its_point() -> None:
    assert plan_fades([(1000 * MS, FAST)], SLOW, 0, 0) == [Fade(500 * MS, 1000 * MS, FAST)]


def test_a_point_too_near_begins_now_and_takes_its_time() -> None:
    assert plan_fades([(100 * MS, FAST)], SLOW, 50 * MS, 0) == [Fade(50 * MS, 550 * MS, FAST)]


def test_fades_wait_for_the_one_before() -> None:
    fades = plan_fades([(100 * MS, FAST), (150 * MS, SLOW)], FAST, 0, 80 * MS)
    assert fades == [Fade(20 * MS, 100 * MS, FAST), Fade(100 * MS, 180 * MS, SLOW)]


def test_kicks_keep_their_order_of_arrival_within_an_instant() -> None:
    impulses: list[Impulse] = []
    for impulse in (Impulse(5, 1, 0), Impulse(3, 2, 0), Impulse(5, 3, 0), Impulse(3, 4, 0)):
        add_impulse(impulses, impulse)
    assert [k.axial_impulse for k in impulses] == [2, 4, 1, 3]


def test_no_crossfade_is_shorter_than_a_thousandth_of_a_period_of_the_faster_motion() -> None:
    assert plan_fades([(100 * MS, FAST)], SLOW, 0, 1) == [
        Fade(100 * MS - round(1e6 / FAST.frequency), 100 * MS, FAST)
    ]
