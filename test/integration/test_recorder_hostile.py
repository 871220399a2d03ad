"""The recorder among publishers and nodes that send anything: it records bytes, and lives on."""

from __future__ import annotations

import signal
from array import array
from pathlib import Path
from typing import Any

import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64MultiArray, String

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.ros.to_messages import IMPACT_FIELDS
from support.processes import Starter, recorder, wait_until
from support.ros_peer import Talker

LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
HEAD = b"\x00\x01\x00\x00"


def text(content: str) -> bytes:
    return bytes(serialize_message(String(data=content)))


def cloud(index: float) -> bytes:
    """A message of disk/impacts with a row of a wrong index."""
    import numpy as np

    rows = np.zeros(1, IMPACT_DTYPE)
    rows["index"] = index
    msg = PointCloud2(
        fields=IMPACT_FIELDS, width=1, height=1, point_step=rows.itemsize,
        data=array("B", rows.tobytes()),
    )  # fmt: skip
    return bytes(serialize_message(msg))


BROKEN = [HEAD + b"\xff" * 40, HEAD + b"\xff\xff\xff\x7f", b"\x00\x07\x00\x00" + bytes(8)]
INPUTS = [
    text('{"kind":"snapshot","index":1e400,"time_ns":0}'),
    text('{"index":1,"time_ns":0,"kind":"snapshot","state":{"a":1e999}}'),
    text('{"index":1,"time_ns":0,"kind":"snapshot",' + "[" * 100_000),
    text('{"index":' + "9" * 5000 + ',"time_ns":0,"kind":"snapshot"}'),
    text("[" * 200_000),
    text("\x00\ud7ff"),
    text(""),
    *BROKEN,
]
CLOUDS = [cloud(float("nan")), cloud(float("inf")), cloud(-1.0), cloud(1e300), *BROKEN]


def test_bytes_are_recorded_whatever_they_say(
    start: Starter, talker: Talker, tmp_path: Path
) -> None:
    process = recorder(start, tmp_path / "run", "max_size:=0.05", "status_period:=0.05")
    inputs = talker.publisher("/disk/inputs", String, LATCHED)
    clouds = talker.publisher("/disk/impacts", PointCloud2)
    for publisher, messages in ((inputs, INPUTS), (clouds, CLOUDS)):
        for message in messages:
            publisher.publish(message)
        publisher.wait_for_all_acked()
    inputs.publish(String(data="the last"))
    process.wait_for(f"recording: .* {len(INPUTS) + len(CLOUDS) + 1} messages")
    wait_until(lambda: talker.node.count_clients("/talker/get_parameters") > 0)
    assert process.end(signal.SIGINT) == 0
    (complaint,) = process.complaints  # the talker's parameters: nothing spins it
    assert "the parameters of /talker are not attached: it gave no answer" in complaint
    assert "impacts missing by their index: 0" in process.stdout
    with bag.open(tmp_path / "run") as run:
        for topic, sent in (("inputs", [*INPUTS, text("the last")]), ("impacts", CLOUDS)):
            found = [row.data for row in run.messages(f"/disk/{topic}")]
            assert len(found) == len(sent)
            for data, given in zip(found, sent, strict=True):  # DDS pads short messages
                assert data in (given, given + bytes(-len(given) % 4))


def test_impacts_are_printed_whatever_comes_before_them(start: Starter, talker: Talker) -> None:
    process = start("echo_impacts", "--ros-args", "-p", "count:=1")
    clouds = talker.publisher("/disk/impacts", PointCloud2)
    wait_until(lambda: clouds.get_subscription_count() > 0)
    for message in (*CLOUDS, cloud(7.0)):
        clouds.publish(message)
    assert process.wait() == 0, process.output
    assert process.stdout.splitlines()[-1].split()[0] == "7"
    assert "Traceback" not in process.output
    assert all(line.startswith("echo_impacts: refused: ") for line in process.complaints)
    assert 1 <= len(process.complaints) <= len(CLOUDS)


# --- nodes that answer anything -------------------------------------------------------------------
class Liar:
    """A node that publishes disk/inputs and answers for its parameters as it is told."""

    def __init__(
        self, talker: Talker, name: str, names: list[str], values: list[Any], services: bool = True
    ) -> None:
        self.asked = 0
        self._names, self._values = names, values
        self.node = node = talker.new_node(name, start_parameter_services=False)
        node.create_publisher(String, "/disk/inputs", LATCHED)
        if not services:
            return
        node.create_service(ListParameters, "~/list_parameters", self._list)
        node.create_service(GetParameters, "~/get_parameters", self._get)

    def _list(self, _: Any, response: Any) -> Any:
        response.result.names = self._names
        self.asked += not self._names
        return response

    def _get(self, _: Any, response: Any) -> Any:
        response.values = self._values
        self.asked += 1
        return response


def value(content: str) -> ParameterValue:
    return ParameterValue(type=4, string_value=content)


def test_answers_of_nodes_are_validated(start: Starter, talker: Talker, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("password: 1234")
    named = tmp_path / "named.yaml"
    named.write_text("/**: {ros__parameters: {restitution: 0.4}}")
    process = recorder(start, tmp_path / "run", f"presets:={named}")
    liars = [
        Liar(talker, "unknown_type", ["a"], [ParameterValue(type=99)]),
        Liar(talker, "too_many", [f"n{i}" for i in range(10_000)], []),
        Liar(talker, "reads_a_secret", ["preset"], [value(str(secret))]),
        Liar(talker, "honest", ["preset"], [value("swum")]),
        Liar(talker, "named", ["b", "preset"], [value("x"), value(str(named))]),
    ]
    lines = {
        "unknown_type": "the parameters of /unknown_type are not attached: .*unexpected parameter",
        "too_many": "the parameters of /too_many are not attached: .*got '10000 of them'",
        "reads_a_secret": "preset '.*secret.yaml': its values are attached, its file is not",
    }
    talker.spin_until(lambda: all(liar.asked for liar in liars if liar is not liars[1]))
    for line in lines.values():
        process.wait_for(line)
    process.wait_for("subscribed to /disk/inputs")
    assert process.end(signal.SIGINT) == 0
    assert len(process.complaints) == len(lines)
    with bag.open(tmp_path / "run") as run:
        attached = run.attachments
    presets = {name for name in attached if name.startswith("preset/")}
    assert presets == {"preset/swum.yaml", "preset/named.yaml"}
    assert attached["preset/named.yaml"] == named.read_bytes()
    assert not any(b"1234" in content for content in attached.values())
    parameters = {name for name in attached if name.startswith("parameters/")}
    kept = ("reads_a_secret", "honest", "named")
    assert parameters == {f"parameters/{name}.yaml" for name in kept}
    honest = yaml.safe_load(attached["parameters/honest.yaml"])
    assert honest == {"/honest": {"ros__parameters": {"preset": "swum"}}}


def test_an_answer_on_its_way_at_the_end_is_waited_for(
    start: Starter, talker: Talker, tmp_path: Path
) -> None:
    process = recorder(start, tmp_path / "run")
    Liar(talker, "without_services", [], [], services=False)
    wait_until(lambda: talker.node.count_clients("/without_services/get_parameters") > 0)
    late = Liar(talker, "late", ["preset"], [value("swum")])
    (service,) = (one for one in late.node.services if one.srv_type is GetParameters)
    answer = service.callback

    def end_first(request: Any, response: Any) -> Any:
        process.send(signal.SIGINT)
        return answer(request, response)

    service.callback = end_first
    talker.spin_until(lambda: not process.running)
    assert process.wait() == 0
    (complaint,) = process.complaints
    assert "the parameters of /without_services are not attached: it gave no answer" in complaint
    with bag.open(tmp_path / "run") as run:
        assert {"parameters/late.yaml", "preset/swum.yaml"} <= run.attachments.keys()


# --- the end --------------------------------------------------------------------------------------
def test_a_recording_that_ends_by_itself_says_so_in_diagnostics(
    start: Starter, talker: Talker, tmp_path: Path
) -> None:
    import sys

    heard: list[Any] = []
    talker.node.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)
    inner = f"ulimit -f 500; exec {sys.executable} -m bouncing_disk_ros recorder {tmp_path}/run"
    options = "--ros-args -p topics:=/large -p compression:=none -p chunk_size:=50000"
    process = start.command(["bash", "-c", f"{inner} {options}"])

    def levels() -> list[int]:
        rows = [row for msg in heard for row in msg.status]
        assert {row.name for row in rows} <= {"recorder: recording"}
        return [row.level[0] for row in rows]

    talker.spin_until(lambda: 0 in levels())
    publisher = talker.publisher("/large", Float64MultiArray)
    message = Float64MultiArray(data=array("d", range(10_000)))

    def is_told() -> bool:
        if process.running:
            publisher.publish(message)
        return 2 in levels()

    talker.spin_until(is_told)
    assert process.wait() == 1
    last = heard[-1].status[0]
    assert "recording ended: File too large" in last.message
    assert process.stderr.count("recording ended: File too large") == 1
    assert "received but not recorded" in process.stdout
    assert "Traceback" not in process.output
    with bag.open(tmp_path / "run") as run:
        assert run.complete
        assert run.message_count > 0
