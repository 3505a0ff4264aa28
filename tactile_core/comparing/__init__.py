"""One recording measured in several ways, and how far each is from the truth."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.comparing.accuracy import Accuracy
from tactile_core.comparing.clock import Clock, in_turn
from tactile_core.comparing.memory import peak_of_stream_mib
from tactile_core.comparing.truth import Arrays, Truth, common_names
from tactile_core.comparing.variants import Recording, Variant, variants_of
from tactile_core.errors import InputError
from tactile_core.fresh_process import one_thread
from tactile_core.outputs import merged_arrays
from tactile_core.profiles.model import Profile
from tactile_core.progress import Progress, Silent
from tactile_core.recording import open_recording
from tactile_core.sensor import images_per_observation


@dataclass(frozen=True)
class Scored:
    """What one variant reached.

    Attributes
    ----------
    name : str
        ``as it is``, or the swap.
    accuracy : dict
        See :meth:`~tactile_core.comparing.accuracy.Accuracy.summary`.
    latency_ms : (n,) tuple of float
        From frame to reading, one thread; the first of a pass, which prepares tables, is left out.
    peak_memory_mib : float or None
        Largest resident memory of a process that only measures this recording, Python and
        libraries included; None where the system does not tell.
    notes : tuple of str
        What the sensor said when it was opened.
    """

    name: str
    accuracy: dict[str, Any]
    latency_ms: tuple[float, ...]
    peak_memory_mib: float | None
    notes: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        median, p90 = np.percentile(self.latency_ms, [50, 90])
        return {
            "variant": self.name,
            **self.accuracy,
            "latency_ms": {"median": round(float(median), 3), "p90": round(float(p90), 3)},
            "timed_frames": len(self.latency_ms),
            "peak_memory_mib": self.peak_memory_mib and round(self.peak_memory_mib, 1),
            "notes": list(self.notes),
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """The variants of a profile, measured on one recording.

    Attributes
    ----------
    profile : Profile
    frames : int
        How many were scored.
    variants : tuple of Scored
        The profile as it is, then one for each swap.
    shown : str
        The frame with the highest truth, for pictures.
    shown_truth : mapping of name to array
    shown_arrays : tuple of mapping
        What each variant measured of it.
    """

    profile: Profile
    frames: int
    variants: tuple[Scored, ...]
    shown: str
    shown_truth: Arrays
    shown_arrays: tuple[Arrays, ...]

    def summary(self) -> dict[str, Any]:
        """What ``tactile compare --json`` prints."""
        return {
            "profile": self.profile.name,
            "frames": self.frames,
            "variants": [scored.summary() for scored in self.variants],
        }


def compare(
    profile: str | Path,
    *,
    input: Path,
    truth: Path,
    swaps: Iterable[tuple[str, str]] = (),
    bundle: Path | None = None,
    reference: Path | str | None = None,
    serial: str | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Measure one recording in several ways and compare each with the truth.

    Variants take turns frame by frame, so that a busy machine slows all alike.

    Parameters
    ----------
    profile : str or Path
        A profile's name or the path of its YAML file.
    input : Path
        The recording.
    truth : Path
        Folder of ``NAME.npz``, one a frame, with arrays as ``tactile run`` writes them; every array
        that both have is compared, at every pixel.
    swaps : iterable of (step, use)
        Each is one change of the profile as it is: ``("height", "core.robust_poisson")``, or
        ``("calibration", path of a bundle)``.
    bundle : Path, optional
        The calibration of all variants but those that swap it; by default the unit's own.
    reference : Path or "first", optional
        The untouched sensor; by default each bundle's.
    serial : str, optional
        The unit.
    progress : Progress, optional

    Raises
    ------
    InputError
        A frame has no truth, or one of another size; a step is not there.
    ProfileError, PluginError, CalibrationError
        A variant cannot be built.
    """
    progress = progress or Silent()
    variants = variants_of(profile, swaps, bundle)
    recording = Recording(Path(input), reference, serial)
    folder = Truth(Path(truth))
    count = _checked_count(variants[0], recording, folder)
    progress.stage("comparing", 0.7)
    scores = [Accuracy() for _ in variants]
    shown: tuple[float, str, Arrays, tuple[Arrays, ...]] | None = None
    frames = 0
    with one_thread(), ExitStack() as stack:
        sensors = [stack.enter_context(variant.open(recording)) for variant in variants]
        clock = Clock([sensor.pipeline for sensor in sensors])
        for readings in in_turn([sensor.stream() for sensor in sensors]):
            name = readings[0].source
            true = folder.of(name)
            arrays = tuple(merged_arrays(reading) for reading in readings)
            names = [common_names(measured, true, folder.path(name)) for measured in arrays]
            if not any(names):
                raise InputError(
                    f"nothing that {folder.path(name)} tells ({', '.join(true)}) was measured; "
                    f"give --bundle, or a truth of what this profile measures"
                )
            for score, measured, common in zip(scores, arrays, names, strict=True):
                score.add(measured, true, common)
            clock.note(readings)
            top = float(true["height_mm"].max()) if "height_mm" in true else 0.0
            if shown is None or top > shown[0]:
                shown = top, name, true, arrays
            frames += 1
            progress.fraction(frames / count if count else 0.0)
        if shown is None:
            raise InputError(f"{input} holds no frame; give a recording with some")
        clock.fill()
    progress.stage("memory", 0.3)
    scored = []
    for number, variant in enumerate(variants):
        peak_mib, notes = peak_of_stream_mib(variant, recording)
        accuracy, times = scores[number].summary(), clock.latency_ms(number)
        scored.append(Scored(variant.name, accuracy, times, peak_mib, notes))
        progress.fraction((number + 1) / len(variants))
    return Comparison(variants[0].profile, frames, tuple(scored), *shown[1:])


def _checked_count(plain: Variant, recording: Recording, truth: Truth) -> int | None:
    """Count the frames, and refuse before long work what has no truth."""
    per_frame = images_per_observation(plain.profile)
    files = open_recording(recording.input, images_per_observation=per_frame)
    truth.check([observation.name for observation in files.files])
    return files.count
