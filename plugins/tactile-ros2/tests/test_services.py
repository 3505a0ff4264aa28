"""Services, offered to a stand-in of ``rclpy``: nothing here has been tried with ROS itself."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")

from support.command_line import refused
from support.virtual_lab import VirtualLab

from tactile_core import HeightMap, open_sensor
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.pipeline.sensor import Sensor
from tactile_ros2.services import Node, Services

ROOT = "/tactile/virtual_lab"


@dataclass
class StandInNode:
    """Keeps the callbacks of services."""

    name: str
    services: dict[str, tuple[Any, Callable[[Any, Any], Any]]] = field(default_factory=dict)
    destroyed: bool = False

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[[Any, Any], Any]
    ) -> Any:
        self.services[srv_name] = (srv_type, callback)

    def destroy_node(self) -> None:
        self.destroyed = True


@dataclass
class StandInRos:
    """``rclpy`` with one node, whose requests wait until the node is spun."""

    node: StandInNode | None = None
    begun: dict[str, Any] = field(default_factory=dict)
    is_shut_down: bool = False
    waiting: list[tuple[str, Any, Any]] = field(default_factory=list)

    def init(self, **options: Any) -> None:
        self.begun = options

    def create_node(self, name: str) -> Node:
        self.node = StandInNode(name)
        return self.node

    def spin_once(self, node: Node, *, timeout_sec: float) -> None:
        assert node is self.node
        assert timeout_sec == 0  # the sensor is not delayed
        while self.waiting:
            name, request, response = self.waiting.pop(0)
            answered = self.node.services[name][1](request, response)
            assert answered is response

    def shutdown(self) -> None:
        self.is_shut_down = True

    def call(self, name: str, **request: Any) -> Any:
        """Send a request; return the response, which is filled in when the node is spun."""
        response = SimpleNamespace(success=None, message="")
        self.waiting.append((f"{ROOT}/{name}", SimpleNamespace(**request), response))
        return response


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch) -> StandInRos:
    made = StandInRos()
    std_srvs = ModuleType("std_srvs")
    services, signals = ModuleType("std_srvs.srv"), ModuleType("rclpy.signals")
    services.Trigger, services.SetBool = "Trigger", "SetBool"  # type: ignore[attr-defined]
    signals.SignalHandlerOptions = SimpleNamespace(NO="no")  # type: ignore[attr-defined]
    for name, module in {
        "rclpy": made,
        "rclpy.signals": signals,
        "std_srvs": std_srvs,
        "std_srvs.srv": services,
    }.items():
        monkeypatch.setitem(sys.modules, name, module)  # type: ignore[arg-type]
    return made


@pytest.fixture
def sensor(lab: VirtualLab, tmp_path: Path) -> Iterator[Sensor]:
    """Open a recording of a ball that is held on the gel."""
    for number in range(30):
        press = BallPress((80.0, 60.0), 4.0, 0.5)
        lab.save(tmp_path / "frames" / f"{number:06d}.png", press, seed=number)
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=tmp_path / "frames") as opened:
        yield opened


def test_the_node_offers_three_services_below_the_sensor_s_topics(
    ros: StandInRos, sensor: Sensor, tmp_path: Path
) -> None:
    with Services(sensor, 7, tmp_path):
        assert ros.begun == {"domain_id": 7, "signal_handler_options": "no"}
        assert ros.node is not None
        assert ros.node.name == "tactile_virtual_lab"
        assert {name: kind for name, (kind, _) in ros.node.services.items()} == {
            f"{ROOT}/reference": "Trigger",
            f"{ROOT}/tare": "Trigger",
            f"{ROOT}/record": "SetBool",
        }
    assert ros.node.destroyed
    assert ros.is_shut_down


def test_a_reference_that_is_asked_for_is_what_the_sensor_shows_now(
    ros: StandInRos, sensor: Sensor, tmp_path: Path
) -> None:
    with Services(sensor, 0, tmp_path) as services:
        assert sensor.read()[HeightMap].mm.max() > 0.3
        response = ros.call("reference")
        assert response.success is None
        services.spin()
        assert (response.success, response.message) == (
            True,
            "the reference is the mean of 10 observations",
        )
        assert np.abs(sensor.read()[HeightMap].mm).max() < 0.1


def test_a_tare_is_passed_on(ros: StandInRos, sensor: Sensor, tmp_path: Path) -> None:
    with Services(sensor, 0, tmp_path) as services:
        response = ros.call("tare")
        services.spin()
        assert response.success
        assert sensor.pipeline.tares


def test_a_recording_is_begun_and_ended(ros: StandInRos, sensor: Sensor, tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    out = tmp_path / "recordings"
    with Services(sensor, 0, out) as services:
        begun, again = ros.call("record", data=True), ros.call("record", data=True)
        services.spin()
        assert begun.success
        assert (again.success, "going on already" in again.message) == (False, True)
        for _ in range(5):
            sensor.read()
        ended = ros.call("record", data=False)
        services.spin()
        assert (ended.success, ended.message) == (True, "the recording is complete")
    (path,) = out.iterdir()
    assert begun.message == f"recording to {path}"
    with open_sensor(sensor.profile, input=path) as played:
        assert sum(1 for _ in played.stream()) == 5


def test_what_cannot_be_done_is_a_response_with_a_sentence(
    ros: StandInRos, sensor: Sensor, tmp_path: Path
) -> None:
    with Services(sensor, 0, tmp_path) as services:
        for _ in sensor.stream():
            pass
        response = ros.call("reference")
        services.spin()
        assert not response.success
        assert "has no observation left for a reference" in response.message


def test_without_ros_the_services_are_refused(
    lab: VirtualLab, sensor: Sensor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    options = ["--input", tmp_path / "frames", "--bundle", lab.bundle]
    said = refused("ros2", lab.profile_path, *options, "--services", tmp_path / "out")
    assert "--services needs rclpy, which ROS 2 brings" in said
