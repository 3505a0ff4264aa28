"""The buttons of a sensor, without a page."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.virtual_lab import VirtualLab
from support.watching import until

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.guided.session import GuidedCalibration
from tactile_core.calibration.guided.touch import Guidance
from tactile_core.errors import CalibrationError, CameraLost, DeviceError, InputError
from tactile_core.pipeline.opening import open_sensor
from tactile_core.quantities import Frame, HeightMap, Reference
from tactile_core.recordings.running_recording import RunningRecording
from tactile_live.commands import (
    Calibrate,
    Finish,
    MoveCommand,
    Play,
    RecordCommand,
    Snapshot,
    TakeCommand,
    TakeReference,
)
from tactile_live.desk import Desk
from tactile_live.opening import wanted_sensors
from tactile_live.shown_state import new_path
from tactile_sim.camera import HandCamera


def done(desk: Desk, command: Any) -> str:
    return asyncio.run(desk.do(command))


def test_a_snapshot_saves_what_run_would_save(desk: Desk, lab: VirtualLab) -> None:
    done(desk, Play(do="play", paused=True))
    sentence = done(desk, Snapshot(do="snapshot"))
    folder = Path(sentence.removeprefix("Saved in "))
    state = desk.live.newest.value
    assert state is not None
    (saved,) = folder.glob("*.npz")
    with np.load(saved) as arrays:
        np.testing.assert_array_equal(arrays["height_mm"], state.reading[HeightMap].mm)
    assert len(list(folder.glob("*.png"))) == 2
    assert done(desk, Snapshot(do="snapshot")) != sentence


def test_a_full_disk_is_a_sentence_and_the_sensor_goes_on(desk: Desk, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file where the folder should be")
    with pytest.raises(InputError, match="is a file"):
        done(desk, Snapshot(do="snapshot"))
    before = desk.live.newest.count
    until(lambda: desk.live.newest.count > before)


def test_a_recording_is_paused_stepped_and_played_again(desk: Desk) -> None:
    live = desk.live
    done(desk, Play(do="play", paused=True))
    done(desk, Play(do="play"))  # the thread that measures waits now
    count = live.newest.count
    done(desk, Play(do="play", step=True))
    until(lambda: live.newest.count == count + 1)
    done(desk, Play(do="play", paused=False, loop=False))
    assert live.playback is not None
    until(lambda: live.playback and live.playback.state.ended)
    last = live.newest.value
    done(desk, Play(do="play", paused=False))
    until(lambda: live.newest.value is not last)


def test_a_reference_is_taken_from_the_next_observations(desk: Desk) -> None:
    before = desk.live.sensor.pipeline.reference
    assert "Reference taken" in done(desk, TakeReference(do="reference", frames=3))
    assert desk.live.sensor.pipeline.reference is not before


def test_a_reference_at_the_end_of_a_loop_is_taken_from_the_beginning(desk: Desk) -> None:
    live = desk.live

    def at_the_end() -> Reference:
        while live.sensor.acquire() is not None:
            pass
        return live.take_reference(3)

    assert live.do(at_the_end).result(30).frames == 3


def test_a_recording_that_has_ended_gives_no_reference(desk: Desk) -> None:
    done(desk, Play(do="play", loop=False))
    until(lambda: desk.live.playback and desk.live.playback.state.ended)
    with pytest.raises(InputError, match="no observation left for a reference; play it again"):
        done(desk, TakeReference(do="reference", frames=3))


def test_only_a_virtual_sensor_has_an_object_to_move(desk: Desk) -> None:
    with pytest.raises(InputError, match="no virtual sensor"):
        done(desk, MoveCommand(do="move", x_mm=0, y_mm=0, angle_deg=0, depth_mm=0.1, pressed=True))


def test_a_camera_that_is_lost_is_looked_for(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    sensor, fails = desk.live.sensor, [True]
    done(desk, TakeReference(do="reference", frames=2))
    reference = sensor.pipeline.reference
    acquire: Callable[..., Any] = sensor.acquire

    def lost(*given: Any) -> Any:
        if fails:
            fails.clear()
            raise CameraLost("the camera was unplugged")
        return acquire(*given)

    monkeypatch.setattr(sensor, "acquire", lost)
    until(lambda: not fails)
    before = desk.live.newest.count
    until(lambda: desk.live.newest.count > before + 1)
    assert desk.live.failure == ""
    assert sensor.pipeline.reference is not None
    assert reference is not None
    np.testing.assert_array_equal(sensor.pipeline.reference.pixels, reference.pixels)


def test_an_object_is_moved_on_a_virtual_sensor_and_the_truth_is_known(virtual: Desk) -> None:
    live = virtual.live
    done(virtual, TakeCommand(do="take", kind="sphere", size_mm=5.0))
    done(virtual, MoveCommand(do="move", x_mm=2, y_mm=-1, angle_deg=0, depth_mm=0.4, pressed=True))

    camera = live.sensor.camera
    assert isinstance(camera, HandCamera)
    until(lambda: camera.truth and camera.truth.depth_mm > 0.35)
    before = live.newest.count
    until(lambda: live.newest.count > before + 1)  # the last state shows the ball where it rests
    state, truth = live.newest.value, camera.truth
    assert state is not None
    assert truth is not None
    measured, true = state.reading[HeightMap].mm, truth.height_mm
    places = [np.unravel_index(one.argmax(), one.shape) for one in (measured, true)]
    assert np.hypot(*np.subtract(*places)) < 8
    assert measured.max() == pytest.approx(true.max(), rel=0.4)
    assert truth.wrench[2] > 0
    assert truth.contact.any()
    done(virtual, MoveCommand(do="move", x_mm=0, y_mm=0, angle_deg=0, depth_mm=0.4, pressed=False))
    until(lambda: camera.truth and camera.truth.wrench[2] == 0)


def test_an_object_that_does_not_exist_is_refused(virtual: Desk) -> None:
    with pytest.raises(InputError, match="no object 'mesh'"):
        done(virtual, TakeCommand(do="take", kind="mesh", size_mm=5.0))


def test_what_is_given_once_holds_for_all_sensors() -> None:
    one, two = wanted_sensors(["hex"], serials=["A", "B"], bundles=[Path("b")])
    assert (one.profile, one.serial, two.serial) == ("hex", "A", "B")
    assert one.bundle == two.bundle == Path("b")
    assert len(wanted_sensors(["hex", "baxter"])) == 2


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"serials": ["A", "B"], "bundles": [Path("b")] * 3}, "there are 2 --serial for 3 sensors"),
        ({"serials": ["A", "A"]}, "named twice"),
    ],
)
def test_sensors_that_do_not_add_up_are_refused(given: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        wanted_sensors(["hex"], **given)


def test_a_recording_is_not_calibrated_live(desk: Desk) -> None:
    with pytest.raises(InputError, match="tactile calibrate"):
        done(desk, Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0))
    with pytest.raises(InputError, match="no calibration is under way"):
        done(desk, Finish(do="finish"))
    assert "ended" in done(desk, Calibrate(do="calibrate", on=False))


@pytest.mark.parametrize("unknown", [None, 0.0])
def test_a_ball_of_unknown_size_is_asked_for(virtual: Desk, unknown: float | None) -> None:
    with pytest.raises(InputError, match="give the diameter of the ball in mm"):
        done(virtual, Calibrate(do="calibrate", on=True, ball_diameter_mm=unknown))
    assert virtual.guiding.state == ""
    assert not list(virtual.live.out.glob("*.mcap"))


def test_a_calibration_without_a_reference_leaves_no_recording(
    virtual: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(frames: int) -> Reference:
        raise CameraLost("the camera was unplugged")

    monkeypatch.setattr(virtual.live.sensor, "capture_reference", lost)
    begun = recordings_of(virtual, monkeypatch)
    with pytest.raises(CameraLost, match="unplugged"):
        done(virtual, Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0))
    assert virtual.guiding.state == ""
    assert all(recording.is_closed for recording in begun)


def recordings_of(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> list[RunningRecording]:
    """Return a list to which every recording is added that begins from now on."""
    begun: list[RunningRecording] = []
    record = desk.live.sensor.record

    def recorded(path: Path) -> RunningRecording:
        begun.append(record(path))
        return begun[-1]

    monkeypatch.setattr(desk.live.sensor, "record", recorded)
    return begun


def test_what_a_page_began_is_carried_out_and_shown_if_it_leaves(
    virtual: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = recordings_of(virtual, monkeypatch)

    async def leave(command: Any, recordings: int) -> None:
        task = asyncio.ensure_future(virtual.do(command))
        await asyncio.to_thread(until, lambda: len(begun) == recordings)
        task.cancel()

    asyncio.run(leave(Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0), 1))
    until(lambda: virtual.status()["calibration"] == "pressing")
    asyncio.run(leave(RecordCommand(do="record", on=True), 2))
    until(lambda: virtual.status()["recording"])
    assert "ended" in done(virtual, Calibrate(do="calibrate", on=False))
    assert "Recorded" in done(virtual, RecordCommand(do="record", on=False))
    assert all(recording.is_closed for recording in begun)


def test_two_pages_begin_one_calibration_and_one_recording(
    virtual: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = recordings_of(virtual, monkeypatch)

    async def both(command: Any) -> list[Any]:
        return await asyncio.gather(
            *(virtual.do(command) for _ in range(2)), return_exceptions=True
        )

    calibrate = Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0)
    (second,) = [one for one in asyncio.run(both(calibrate)) if isinstance(one, InputError)]
    assert "under way" in str(second)
    asyncio.run(both(RecordCommand(do="record", on=True)))
    assert len(begun) == 2
    done(virtual, Calibrate(do="calibrate", on=False))
    done(virtual, RecordCommand(do="record", on=False))
    assert all(recording.is_closed for recording in begun)


def test_two_pages_save_two_snapshots_in_one_second(desk: Desk) -> None:
    async def both() -> list[str]:
        return await asyncio.gather(*(desk.do(Snapshot(do="snapshot")) for _ in range(3)))

    folders = {Path(said.removeprefix("Saved in ")) for said in asyncio.run(both())}
    assert len(folders) == 3
    assert all(list(folder.glob("*.npz")) for folder in folders)


def test_names_of_new_files_are_never_given_twice(tmp_path: Path) -> None:
    assert len({new_path(tmp_path, "one", ".mcap") for _ in range(5)}) == 5


def test_a_calibration_that_is_fitted_is_not_ended(
    virtual: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    fits, seen = threading.Event(), threading.Event()

    def slow(self: GuidedCalibration) -> Any:
        fits.set()
        seen.wait(20)
        raise CalibrationError("no press was kept, so there is nothing to calibrate on")

    monkeypatch.setattr(GuidedCalibration, "finish", slow)
    done(virtual, Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0))

    async def fitted() -> None:
        fitting = asyncio.ensure_future(virtual.do(Finish(do="finish")))
        await asyncio.to_thread(fits.wait, 20)
        with pytest.raises(InputError, match="being fitted"):
            await virtual.do(Calibrate(do="calibrate", on=False))
        assert virtual.status()["calibration"] == "fitting"
        seen.set()
        with pytest.raises(CalibrationError):
            await fitting

    asyncio.run(fitted())
    assert virtual.status()["calibration"] == "pressing"


def test_nobody_waits_for_a_camera_that_is_lost(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lost(*given: Any) -> Any:
        raise CameraLost("the camera was unplugged")

    with monkeypatch.context() as unplugged:
        unplugged.setattr(desk.live.sensor, "acquire", lost)
        unplugged.setattr(desk.live.sensor, "open", lost)
        until(lambda: desk.live.failure)
        for command in (
            RecordCommand(do="record", on=True),
            TakeReference(do="reference", frames=1),
        ):
            with pytest.raises(DeviceError, match="unplugged"):
                done(desk, command)
    assert desk.status()["recording"] is None


def test_an_implausible_ball_is_refused_and_nothing_stays_open(virtual: Desk) -> None:
    with pytest.raises(InputError, match="ball"):
        done(virtual, Calibrate(do="calibrate", on=True, ball_diameter_mm=0.01))
    assert virtual.guiding.state == ""
    assert virtual.live.guide is None


def test_a_process_that_is_killed_ends_the_calibration_not_the_sensor(
    virtual: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    live = virtual.live

    def killed(self: GuidedCalibration, frame: Frame) -> Guidance:
        raise ChildProcessError("a process that judges presses was killed")

    monkeypatch.setattr(GuidedCalibration, "feed", killed)
    done(virtual, Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0))
    until(lambda: virtual.guiding.state == "")
    before = live.newest.count
    until(lambda: live.newest.count > before + 1)
    assert "was killed" in virtual.status()["failure"]
    assert "bug" not in virtual.status()["failure"]
    assert virtual.status()["recording"] is None
    monkeypatch.undo()
    done(virtual, Calibrate(do="calibrate", on=True, ball_diameter_mm=4.0))
    assert virtual.status()["failure"] == ""


def test_a_sensor_measures_with_another_bundle(lab: VirtualLab) -> None:
    with open_sensor(lab.profile_path, input=lab.presses, reference=lab.reference) as sensor:
        assert HeightMap not in sensor.read()
        sensor.use_bundle(Bundle.load(lab.bundle))
        assert HeightMap in sensor.read()


def test_what_the_camera_sends_is_recorded_until_the_end(desk: Desk) -> None:
    pytest.importorskip("mcap", reason="the extra 'record' is not installed")
    said = done(desk, RecordCommand(do="record", on=True))
    until(lambda: (desk.status()["recording"] or {}).get("images", 0) > 2)
    assert "Recorded" in done(desk, RecordCommand(do="record", on=False))
    assert desk.status()["recording"] is None
    path = Path(said.removeprefix("Recording to "))
    with open_sensor(desk.live.sensor.profile, input=path) as replayed:
        assert replayed.read()[HeightMap].mm.shape == (120, 160)
