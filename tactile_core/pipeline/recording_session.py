"""Records a sensor for a while, with or without measuring."""

from __future__ import annotations

from collections.abc import Iterator

from tactile_core.acquisition.free_running import HOST, Clock
from tactile_core.pipeline.sensor import Sensor
from tactile_core.recordings.running_recording import RunningRecording


class WAITING:
    """How a recording is watched that needs no reading."""

    look_s = 0.1  # [s] Time between two looks at it. Source: ten in a second seem continuous.


def keep_recording(
    sensor: Sensor,
    recording: RunningRecording,
    *,
    seconds: float | None = None,
    frames: int | None = None,
    timeout_s: float = 1.0,
    clock: Clock = HOST,
) -> Iterator[float]:
    """Keep a recording going, and yield the completed fraction from time to time.

    Without readings nothing is measured, and images of a streaming camera are not even decoded.

    Parameters
    ----------
    sensor : Sensor
    recording : RunningRecording
        Of this sensor.
    seconds : float, optional
        Length. Default: until the camera's recording ends or the caller stops.
    frames : int, optional
        Number of observations.
    timeout_s : float
        Longest wait for an image.

    Raises
    ------
    OSError
        The recording failed.
    CameraTimeout, CameraLost, LightsLost, SequenceError
        As :meth:`Sensor.acquire <tactile_core.pipeline.sensor.Sensor.acquire>`.
    """
    began_s, done = clock.now(), 0
    watched = sensor.records_all and not recording.readings
    if watched:
        recording.limit = frames
    last, last_s = 0, began_s
    while True:
        elapsed_s = clock.now() - began_s
        shares = [0.0 if frames is None else done / frames]
        shares.append(0.0 if seconds is None else elapsed_s / seconds)
        yield min(1.0, max(shares))
        if recording.failure is not None:
            raise OSError(recording.failure)
        if max(shares) >= 1:
            return
        if watched:
            clock.sleep(WAITING.look_s)
            done = recording.images + recording.dropped
            if done > last:
                last, last_s = done, clock.now()
            elif clock.now() - last_s > timeout_s:
                sensor.acquire(timeout_s)  # says why nothing comes, or opens the camera again
                last_s = clock.now()
            continue
        frame = sensor.acquire(timeout_s)
        if frame is None:
            return
        if recording.readings:
            sensor.measure(frame)
        done += 1
