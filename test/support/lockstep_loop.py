"""A simulator in lockstep with controllers, all in one executor, and digests of what it did."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import join_rows
from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.units import NS
from support.controllers import GateController
from support.digest import Digest, digest_of
from support.ros import Nodes


def kept(node: SimulatorNode) -> list[Record]:
    """Keep the records of the inputs of a node from here on."""
    assert node.run is not None
    session, records = node.run.session, []
    publish = session._record

    def record(one: Record) -> None:
        records.append(one)
        publish(one)

    session._record = record
    return records


def digest(records: Sequence[Record], rows: NDArray[Any], count: int) -> Digest:
    """Of the first trajectories of a run, and of its impacts until the last of them."""
    inputs = [one for one in records if one["kind"] == "trajectory"][:count]
    assert len(inputs) == count
    moves = [[one["time_ns"], one["begin_ns"], one["joints"]] for one in inputs]
    return digest_of([moves, rows[rows["time"] <= inputs[-1]["time_ns"] / NS]])


class Loop(Nodes):
    """A simulator in lockstep; `numbers` of controllers that are made elsewhere."""

    def __init__(self, controllers: int, numbers: str = "", **values: Any) -> None:
        super().__init__()
        own = " ".join(str(number) for number in range(1, controllers + 1))
        values = {"lockstep_controllers": numbers or own, "real_time_factor": 0.0, **values}
        self.node = self.simulator(**values)
        self.records: list[Record] = []
        self._first: Record = {}
        self._clouds: list[NDArray[Any]] = []
        if self.node.run is not None:
            self.watch()
        for number in range(1, controllers + 1):
            self.add(GateController(number, context=self.context))

    def watch(self) -> None:
        """Keep inputs and rows from here on, before anything has moved."""
        run = self.node.run
        assert run is not None
        outputs = self.node.outputs
        assert outputs is not None
        publish = outputs.impacts
        self._first = {
            "index": 0, "time_ns": run.session.time_ns, "kind": "snapshot", "held": True,
            "state": run.session.simulation.snapshot(), "parameters": dict(run.session.values),
            "version": "",
        }  # fmt: skip
        self.records = kept(self.node)

        def impacts(rows: NDArray[Any]) -> None:
            self._clouds.append(rows.copy())
            publish(rows)

        outputs.impacts = impacts  # type: ignore[method-assign]

    @property
    def controllers(self) -> list[Any]:
        """All nodes but the simulator."""
        return self.nodes[1:]

    @property
    def all_records(self) -> list[Record]:
        """With a snapshot of when they began."""
        return [self._first, *self.records]

    @property
    def rows(self) -> NDArray[np.void]:
        """All rows of impacts."""
        return join_rows(self._clouds)

    @property
    def gate(self) -> int:
        """The newest gate."""
        run = self.node.run
        assert run is not None
        assert run.gates is not None
        return run.gates.number
