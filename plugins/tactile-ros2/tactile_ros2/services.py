"""Services of a sensor in ROS 2: a thin adapter to ``rclpy``, which has not been tried with ROS."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from tactile_core.errors import InputError, TactileError
from tactile_core.formats.folders import make_folder
from tactile_core.interfaces.device import Closing
from tactile_core.interfaces.sink import OpenRecording
from tactile_core.pipeline.sensor import Sensor
from tactile_ros2.broadcast import names_of


class Node(Protocol):
    """What is used of ``rclpy.node.Node``."""

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[[Any, Any], Any]
    ) -> Any:
        """Offer a service."""

    def destroy_node(self) -> None:
        """Withdraw the node and its services."""


class Services(Closing):
    """Reference, tare and recording as services of a node; use it in a ``with`` block.

    ``reference`` and ``tare`` are ``std_srvs/Trigger``, ``record`` is ``std_srvs/SetBool``, below
    the sensor's topics. They are answered by :meth:`spin`, between two observations, so that
    nothing else uses the sensor meanwhile.

    Parameters
    ----------
    sensor : Sensor
        Open.
    domain : int
    out : Path
        Folder for recordings.

    Raises
    ------
    InputError
        There is no ROS.
    """

    def __init__(self, sensor: Sensor, domain: int, out: Path) -> None:
        try:
            self._rclpy: Any = import_module("rclpy")
            signals: Any = import_module("rclpy.signals")
            types: Any = import_module("std_srvs.srv")
        except ImportError as error:
            raise InputError(
                "--services needs rclpy, which ROS 2 brings; source the setup.bash of ROS first, "
                "with the Python of ROS, or leave --services out"
            ) from error
        self._sensor, self._out = sensor, out
        self._recording: OpenRecording | None = None
        names = names_of(sensor)
        # Ctrl-C is the command's
        self._rclpy.init(domain_id=domain, signal_handler_options=signals.SignalHandlerOptions.NO)
        self._node: Node | None = self._rclpy.create_node(names.root.strip("/").replace("/", "_"))
        for name, kind, work in (
            ("reference", types.Trigger, self._take_reference),
            ("tare", types.Trigger, self._tare),
            ("record", types.SetBool, self._record),
        ):
            self._node.create_service(kind, names.topic(name), _answering(work))

    def spin(self) -> None:
        """Answer the requests that have arrived."""
        self._rclpy.spin_once(self._node, timeout_sec=0.0)

    def close(self) -> None:
        """End a recording, and withdraw the services; may be called twice."""
        node, self._node = self._node, None
        if node is not None:
            try:
                self._end_recording()
            finally:
                node.destroy_node()
                self._rclpy.shutdown()

    def _take_reference(self, _: Any) -> str:
        frames = self._sensor.capture_reference().frames
        return f"the reference is the mean of {frames} observations"

    def _tare(self, _: Any) -> str:
        self._sensor.tare()
        return "the load of the next reading is subtracted from now on"

    def _record(self, request: Any) -> str:
        if not request.data:
            return self._end_recording()
        if self._recording is not None:
            raise InputError("a recording is going on already; end it with data: false")
        make_folder(self._out)
        path = self._out / f"{names_of(self._sensor).root.rsplit('/')[-1]}-{time.time_ns()}.mcap"
        self._recording = self._sensor.record(path)
        return f"recording to {path}"

    def _end_recording(self) -> str:
        recording, self._recording = self._recording, None
        if recording is None:
            return "nothing was recorded"
        recording.close()
        if recording.failure:
            raise InputError(recording.failure)
        return "the recording is complete"


def _answering(work: Callable[[Any], str]) -> Callable[[Any, Any], Any]:
    """Return the callback of a service whose response has ``success`` and ``message``."""

    def answer(request: Any, response: Any) -> Any:
        try:
            response.success, response.message = True, work(request)
        except (TactileError, OSError) as error:
            response.success, response.message = False, str(error)
        return response

    return answer
