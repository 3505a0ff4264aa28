"""A sensor is published into another process, over DDS on the loopback interface."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")

from support.command_line import refused, tactile
from support.ros2_subscriber import LOOPBACK, OWN_DOMAIN, Subscriber, stamp_ns
from support.virtual_lab import VirtualLab

from tactile_core import HeightMap, open_sensor
from tactile_core.acquisition.free_running import Clock
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_ros2.broadcast import Broadcast
from tactile_ros2.publisher import Publisher, domain_of

ROOT = "/tactile/virtual_lab"
TOPICS = {
    f"{ROOT}/image_raw": "sensor_msgs/msg/Image",
    f"{ROOT}/height": "sensor_msgs/msg/Image",
    f"{ROOT}/points": "sensor_msgs/msg/PointCloud2",
    f"{ROOT}/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
FRAMES = 45


@pytest.fixture(autouse=True)
def loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


@pytest.fixture(scope="module")
def folder(lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball that is pressed deeper and deeper, for a second and a half."""
    made = tmp_path_factory.mktemp("played") / "frames"
    for number in range(FRAMES):
        press = BallPress((80.0, 60.0), 4.0, 0.1 + 0.015 * number)
        lab.save(made / f"{number:06d}.png", press, seed=number)
    return made


def test_no_message_is_lost_and_stamps_and_heights_are_those_of_the_sensor(
    lab: VirtualLab, folder: Path
) -> None:
    words = [lab.profile_path, "--bundle", lab.bundle, "--input", folder, "--domain", OWN_DOMAIN]
    command = [sys.executable, "-m", "tactile_core.cli", "ros2", *map(str, words)]
    stamped = list(TOPICS)[:3]
    with Subscriber(OWN_DOMAIN, TOPICS) as subscriber:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        # the first may have been sent before both had found one another
        subscriber.wait_for(FRAMES - 15, stamped)
    assert done.stdout.splitlines() == [f"{topic} {kind}" for topic, kind in TOPICS.items()]
    assert "not measured: force, slip; so these topics are left out" in done.stderr
    with open_sensor(lab.profile_path, bundle=lab.bundle, input=folder) as sensor:
        expected = [one[HeightMap].finite().mm for one in sensor.stream()]
    for topic in stamped:
        messages = subscriber.messages(topic)
        # the first is played before the second sets the pace
        stamps_s = [stamp_ns(one) * 1e-9 for one in messages[1:]]
        np.testing.assert_allclose(np.diff(stamps_s), 1 / 30, atol=1e-3)
        assert {one.header.frame_id for one in messages} == {"tactile_virtual_lab_optical"}
    heights = subscriber.messages(f"{ROOT}/height")
    for message, mm in zip(heights, expected[-len(heights) :], strict=True):
        metres = message.data.view("<f4").reshape(message.height, message.width)
        np.testing.assert_array_equal(metres, (mm.astype(np.float64) * 1e-3).astype(np.float32))
    assert max(one.data.view("<f4").max() for one in heights) > 0.3e-3


@pytest.fixture
def host() -> tuple[Clock, list[float]]:
    """Return a clock whose seconds pass only in waiting, and its time."""
    now = [0.0]
    return Clock(lambda: now[0], lambda s: now.__setitem__(0, now[0] + s)), now


def test_a_note_says_once_that_nobody_listens(
    lab: VirtualLab, tmp_path: Path, host: tuple[Clock, list[float]]
) -> None:
    for number in range(4):
        lab.save(tmp_path / "frames" / f"{number}.png", None, seed=number)
    clock, now = host
    said: list[str] = []
    with (
        open_sensor(lab.profile_path, bundle=lab.bundle, input=tmp_path / "frames") as sensor,
        Publisher(OWN_DOMAIN) as publisher,
    ):
        for published in Broadcast(sensor, publisher, said.append, clock).publish():
            assert published.topics == ()
            now[0] += 6
    alone = [note for note in said if "nobody" in note]
    assert len(alone) == 1
    assert f"domain {OWN_DOMAIN} for 10 s; set the same ROS_DOMAIN_ID" in alone[0]


def test_a_subscriber_that_takes_losses_is_served_as_well(lab: VirtualLab, folder: Path) -> None:
    topic = f"{ROOT}/height"
    with (
        Publisher(OWN_DOMAIN) as publisher,
        open_sensor(lab.profile_path, bundle=lab.bundle, input=folder) as sensor,
        Subscriber(OWN_DOMAIN, {topic: TOPICS[topic]}, reliable=False) as subscriber,
    ):
        broadcast = Broadcast(sensor, publisher, lambda note: None)
        ready = threading.Event()
        while not publisher.is_heard(topic):
            ready.wait(0.01)
        sent = [one for one in broadcast.publish() if one.topics == ("height",)]
        subscriber.wait_for(len(sent) - 5, [topic])
    assert len(sent) == FRAMES


def test_a_virtual_sensor_goes_on_until_it_is_stopped() -> None:
    # its movement takes 27 frames
    done = tactile("ros2", "digit", "--sim", "--frames", "40", "--domain", OWN_DOMAIN)
    assert done.returncode == 0, done.stderr
    assert "/tactile/digit/image_raw sensor_msgs/msg/Image" in done.stdout
    assert "note: only" not in done.stderr


@pytest.mark.parametrize("domain", [-1, 233])
def test_a_domain_out_of_range_is_refused(lab: VirtualLab, domain: int) -> None:
    said = refused("ros2", lab.profile_path, "--domain", domain)
    assert f"--domain is '{domain}', but domains are numbers from 0 to 232" in said


def test_the_domain_is_that_of_ros_unless_one_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert domain_of(None) == 0
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    assert (domain_of(None), domain_of(7)) == (42, 7)


def test_a_variable_that_is_no_number_is_refused(
    lab: VirtualLab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "robot")
    assert "ROS_DOMAIN_ID is 'robot'" in refused("ros2", lab.profile_path)


def test_a_network_that_cannot_be_used_is_one_sentence(
    lab: VirtualLab, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "<nonsense/>")
    options = ["--input", folder, "--bundle", lab.bundle, "--domain", "231"]
    done = tactile("ros2", lab.profile_path, *options)
    assert done.returncode != 0
    assert "domain 231 cannot be joined" in done.stderr
    assert "CYCLONEDDS_URI" in done.stderr
    assert "Traceback" not in done.stderr


def test_input_and_sim_exclude_each_other(lab: VirtualLab, folder: Path) -> None:
    said = refused("ros2", lab.profile_path, "--sim", "--input", folder)
    assert "exclude each other" in said
