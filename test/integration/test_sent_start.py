"""A click on the map, a second one, and a simulator node whose first impact is that start."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pytest
from bokeh.events import Tap
from rclpy.parameter import Parameter

from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.testing import SteppedSimulator
from bouncing_disk_ros.workbench.basin_pane import BasinPane
from bouncing_disk_ros.workbench.start_plane import orbit_of, start_at
from support.bokeh_page import BokehPage
from support.ros_peer import Peer

LATER = 1.2345678  # s; the run is anywhere when the disk is sent


@pytest.fixture
def peer(ros_domain: int) -> Iterator[Peer]:
    peer = Peer()
    yield peer
    peer.close()


def test_a_node_goes_on_from_the_start_that_was_clicked(
    ros_domain: int,
    warm_kernels: None,
    stepped_simulator: Callable[..., SteppedSimulator],
    peer: Peer,
) -> None:
    simulator = stepped_simulator()
    values = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}

    def send(start: Mapping[str, Any]) -> None:
        parameters = [Parameter(name, value=value) for name, value in start.items()]
        assert simulator.node.set_parameters_atomically(parameters).successful
        simulator.reset()

    simulator.wait_for_subscriber("disk/impacts")
    simulator.advance(LATER)
    pane = BasinPane(lambda: values, send)
    page = BokehPage(pane)
    pane.parameters_changed()
    page.settle()
    for _ in range(2):
        page.trigger(Tap(pane.plot, x=4.0, y=-2.5))
    simulator.advance(1.0)
    assert simulator.node.run is not None
    total = simulator.node.run.session.simulation.rows_total
    peer.spin_until(lambda: len(peer.rows) == total)
    assert pane.start is not None
    rows = peer.rows[peer.rows["time"] >= LATER]
    assert rows["forcing_phase"][0] == pane.start.forcing_phase
    assert rows["axial_impact_velocity"][0] == pane.start.impact_velocity
    # later impacts: the time of the run, which is not 0, has roundings of its own; of some 1e-15
    # rad, each flight makes at most ten times as much on the way to period 1
    expected = orbit_of(values, start_at(values, *pane.start[:2]))
    assert len(rows) > 3
    np.testing.assert_allclose(
        rows["forcing_phase"][:3], expected.forcing_phase[:3], rtol=0.0, atol=1e-12
    )
