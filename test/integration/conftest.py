"""What these tests share: stepped simulators, and a peer that hears and commands a simulator."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

from support.ros_peer import Peer

if TYPE_CHECKING:
    from bouncing_disk_ros.testing import SteppedSimulator


@pytest.fixture
def make(
    ros_domain: int, warm_kernels: None, stepped_simulator: Callable[..., SteppedSimulator]
) -> Callable[..., SteppedSimulator]:
    """Make stepped simulators: the fixture of the package, after the kernels are warm."""
    return stepped_simulator


@pytest.fixture
def peer(ros_domain: int, warm_kernels: None) -> Iterator[Peer]:
    """A peer of the simulators without a namespace."""
    made = Peer()
    yield made
    made.close()
