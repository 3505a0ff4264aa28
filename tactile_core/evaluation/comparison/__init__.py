"""Compare estimators or calibrations on one recording against ground truth."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.evaluation.comparison.accuracy import Accuracy, Arrays, Truth, common_names
from tactile_core.evaluation.comparison.report import Comparison as Comparison
from tactile_core.evaluation.comparison.report import Scored as Scored
from tactile_core.evaluation.comparison.report import (
    interleave_readings,
    peak_of_stream_mib,
)
from tactile_core.evaluation.comparison.variants import ComparedInput, Variant, variants_of
from tactile_core.evaluation.own_resources import one_thread
from tactile_core.formats.npz import arrays_of
from tactile_core.interfaces.calibrator import Progress, Silent
from tactile_core.pipeline.playback import images_per_observation
from tactile_core.plugins.blame import blame_of
from tactile_core.recordings.recording import open_recording


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
    """Measure one recording with several variants of a profile and score each against the truth.

    Variants alternate frame by frame, so that other load on the machine affects all equally.

    Parameters
    ----------
    profile : str or Path
        A profile's name or the path of its YAML file.
    input : Path
        The recording.
    truth : Path
        Folder of one ``NAME.npz`` per frame, with arrays as ``tactile run`` writes them. Every
        array that both the truth and the measurement have is compared, at every pixel.
    swaps : iterable of (step, use)
        Each swap is one variant that differs from the profile in one step:
        ``("height", "core.robust_poisson")`` or ``("calibration", path of a bundle)``.
    bundle : Path, optional
        Calibration of all variants that do not swap it. Default: the unit's own.
    reference : Path or "first", optional
        Recording of the undeformed sensor. Default: the reference of each bundle.
    serial : str, optional
        Serial number of the unit.
    progress : Progress, optional

    Raises
    ------
    InputError
        The truth of a frame is missing or has another size, or a step does not exist.
    ProfileError, PluginError, CalibrationError
        A variant cannot be built.
    """
    progress = progress or Silent()
    variants = variants_of(profile, swaps, bundle)
    recording = ComparedInput(Path(input), reference, serial)
    folder = Truth(Path(truth))
    count = _checked_count(variants[0], recording, folder)
    progress.stage("comparing", 0.7)
    scores = [Accuracy() for _ in variants]
    latencies_ms: list[list[float]] = [[] for _ in variants]
    shown: tuple[float, str, Arrays, tuple[Arrays, ...]] | None = None
    frames = 0
    with one_thread(), ExitStack() as stack:
        sensors = [stack.enter_context(variant.open(recording)) for variant in variants]
        for readings in interleave_readings([sensor.stream() for sensor in sensors]):
            name = readings[0].source
            true = folder.read_arrays(name)
            arrays = tuple(
                arrays_of(r.quantities.values(), mm_per_px=r.frame.mm_per_px, guard=blame_of)
                for r in readings
            )
            names = [common_names(measured, true, folder.path(name)) for measured in arrays]
            if not any(names):
                raise InputError(
                    f"none of the arrays in {folder.path(name)} ({', '.join(true)}) was measured; "
                    f"give --bundle, or ground truth of quantities that this profile measures"
                )
            for score, measured, common in zip(scores, arrays, names, strict=True):
                score.add(measured, true, common)
            for times, reading in zip(latencies_ms, readings, strict=True):
                times.append(reading.latency_ms)
            top = float(true["height_mm"].max()) if "height_mm" in names[0] else 0.0
            if shown is None or top > shown[0]:
                shown = top, name, true, arrays
            frames += 1
            progress.fraction(frames / count if count else 0.0)
        if shown is None:
            raise InputError(f"{input} contains no frames; give another recording")
    progress.stage("memory", 0.3)
    scored = []
    for number, variant in enumerate(variants):
        peak_mib, notes = peak_of_stream_mib(variant, recording)
        accuracy = scores[number].summary()
        # the first frame prepares tables
        timed = tuple(latencies_ms[number][1:] or latencies_ms[number])
        scored.append(Scored(variant.name, accuracy, timed, peak_mib, notes))
        progress.fraction((number + 1) / len(variants))
    return Comparison(variants[0].profile, frames, tuple(scored), *shown[1:])


def _checked_count(plain: Variant, recording: ComparedInput, truth: Truth) -> int | None:
    """Count the frames, after a check that each has ground truth."""
    per_frame = images_per_observation(plain.profile)
    files = open_recording(recording.input, images_per_observation=per_frame)
    truth.check(list(files.names or ()))
    return files.count
