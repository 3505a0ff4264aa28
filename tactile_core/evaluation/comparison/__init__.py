"""Compare estimators or calibrations on one recording against ground truth."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Any

from tactile_core.acquisition.devices import images_per_observation
from tactile_core.errors import InputError, PluginError, ProfileError, TactileError
from tactile_core.evaluation.comparison.accuracy import Accuracy, Arrays, Truth, common_names
from tactile_core.evaluation.comparison.report import Comparison as Comparison
from tactile_core.evaluation.comparison.report import Scored as Scored
from tactile_core.evaluation.own_resources import one_thread, peak_memory_mib
from tactile_core.formats.npz import arrays_of
from tactile_core.formats.yaml_tree import mapping_of
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.pipeline.workers import WorkerProcess
from tactile_core.plugins.blame import blame_of
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.recordings.recording import open_recording

CALIBRATION = "calibration"


@dataclass(frozen=True)
class ComparedInput:
    """The recording that every variant measures.

    Attributes
    ----------
    input : Path
    reference : Path, "first" or None
        Recording of the undeformed sensor; None for that of the bundle.
    serial : str or None
        Serial number of the unit.
    """

    input: Path
    reference: Path | str | None = None
    serial: str | None = None


@dataclass(frozen=True)
class Variant:
    """A profile and a bundle to measure a recording with.

    Attributes
    ----------
    name : str
        ``as it is`` for the unchanged profile, or the swap.
    profile : Profile
    bundle : Path or None
        Calibration; None for the unit's own, if any.
    """

    name: str
    profile: Profile
    bundle: Path | None = None

    def open(self, recording: ComparedInput) -> Sensor:
        """Open the recording as a sensor of this variant.

        Raises
        ------
        TactileError
            As :func:`~tactile_core.pipeline.opening.open_sensor`, prefixed by the variant's name.
        """
        try:
            return open_sensor(
                self.profile,
                serial=recording.serial,
                bundle=self.bundle,
                input=recording.input,
                reference=recording.reference,
            )
        except TactileError as error:
            raise type(error)(f"{self.name}: {error}") from error


def variants_of(
    profile: str | Path, swaps: Iterable[tuple[str, str]], bundle: Path | None = None
) -> list[Variant]:
    """Return the unchanged profile, and one variant per swap.

    Parameters
    ----------
    profile : str or Path
        A profile's name or the path of its YAML file.
    swaps : iterable of (step, use)
        A step of the profile's chain and the estimator to use in it, by name or with options as a
        profile writes it: ``{use: networks.force_cnn, manifest: my.yaml}``. Options that both
        estimators have are kept; the others take their defaults. Or ``("calibration", path of a
        bundle)``.
    bundle : Path, optional
        Calibration of all variants that do not swap it.

    Raises
    ------
    InputError
        The profile has no such step.
    ProfileError, PluginError
        The estimator does not exist, or does not fit the step.
    """
    unique_swaps = list(dict.fromkeys(swaps))
    plain = load_profile(profile)
    variants = [Variant("as it is", plain, bundle)]
    for step, use in unique_swaps:
        name = f"{step}={use}"
        if step == CALIBRATION:
            variants.append(Variant(name, plain, _bundle_folder(use)))
            continue
        _check_step(step, plain)
        component = _component(step, use)
        resolve("estimator", component["use"])
        try:
            swapped = load_profile(profile, overrides={"estimators": {step: component}})
        except ProfileError as error:
            raise ProfileError(f"{name}: {error}", error.problems) from error
        variants.append(Variant(name, swapped, bundle))
    return variants


def parse_swap(words: str) -> tuple[str, str]:
    """Return step and use of ``STEP=USE``.

    Raises
    ------
    InputError
        The text does not have this form.
    """
    step, equals, use = words.partition("=")
    if not (step and equals and use):
        raise InputError(
            f"--swap {words}: write STEP=USE, for example height=core.robust_poisson or "
            f"calibration=path/of/a/bundle"
        )
    return step, use


def _component(step: str, use: str) -> dict[str, Any]:
    """Return the section of a profile that names an estimator."""
    if not use.startswith("{"):
        return {"use": use}
    section = mapping_of(use, Path(f"--swap {step}"))
    if not isinstance(section.get("use"), str):
        raise InputError(f"--swap {step}={use}: name the estimator, {{use: plugin.name, …}}")
    return section


def _check_step(step: str, profile: Profile) -> None:
    steps = [*profile.estimators, CALIBRATION]
    if step in steps:
        return
    near = get_close_matches(step, steps, 1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise InputError(f"{profile.name} has no step {step!r}; {hint}There are {', '.join(steps)}")


def _bundle_folder(use: str) -> Path:
    folder = Path(use)
    if not folder.is_dir():
        try:
            resolve("calibrator", use)
        except PluginError:
            raise InputError(
                f"calibration={use}: there is no such folder; give the folder of a bundle from "
                f"'tactile calibrate'"
            ) from None
        raise InputError(
            f"calibration={use}: {use} is a model that has to be fitted first; run 'tactile "
            f"calibrate … --model {use} --out FOLDER' and swap in calibration=FOLDER"
        )
    return folder


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


def interleave_readings(streams: Sequence[Iterator[Reading]]) -> Iterator[list[Reading]]:
    """Yield the readings of each frame; the streams rotate so that each is first equally often."""
    number = 0
    while True:
        readings: dict[int, Reading] = {}
        for turn in range(len(streams)):
            index = (number + turn) % len(streams)
            reading = next(streams[index], None)
            if reading is None:
                return
            readings[index] = reading
        yield [readings[index] for index in range(len(streams))]
        number += 1


# Frames that the process measures. Chosen by hand; memory no longer grows after the first few.
FRAMES = 20


def peak_of_stream_mib(
    variant: Variant, recording: ComparedInput
) -> tuple[float | None, tuple[str, ...]]:
    """Measure the first frames in a separate process.

    Returns
    -------
    peak_mib : float or None
        Its peak resident memory, including Python and libraries.
    notes : tuple of str
        Notes of the sensor on opening.
    """
    with WorkerProcess(_stream, variant, recording) as process:
        peak_mib, notes = process.receive()
    return peak_mib, notes


def _stream(variant: Variant, recording: ComparedInput) -> Generator[Any, None, None]:
    with variant.open(recording) as sensor:
        for _ in islice(sensor.stream(), FRAMES):
            pass
        yield peak_memory_mib(), sensor.notes
