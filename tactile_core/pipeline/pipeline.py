"""Computes readings from frames with a profile, a bundle and a reference; needs no device."""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from time import perf_counter, thread_time

import numpy as np

from tactile_core.acquisition.assembly import Assembly, lights_of
from tactile_core.bundles.bundle import Bundle
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.conditioning.sequence_check import is_sequential
from tactile_core.errors import InputError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.chain import Chain, Step
from tactile_core.pipeline.compiling import already_compiled
from tactile_core.pipeline.frame_check import check_channels, check_order, check_size
from tactile_core.pipeline.made_up_frames import made_up_frames, made_up_reference
from tactile_core.pipeline.notes import (
    exposure_warnings,
    left_out_notes,
    not_given,
    without_slopes,
)
from tactile_core.pipeline.playback import make_lights
from tactile_core.pipeline.profile_steps import chain_of, made_steps
from tactile_core.pipeline.shared_frames import shared_out
from tactile_core.plugins.blame import blame, blame_of
from tactile_core.plugins.calibrators import calibrator_of, uncalibrated_by
from tactile_core.plugins.returned import measured_by, reference_gradients
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    Float32,
    Frame,
    Gradients,
    HeightMap,
    Image,
    MarkerDetections,
    Pixels,
    Quantity,
    Reference,
    ReferenceGradients,
)

COMPILING_S = 5.0
"""Processor time that a frame takes only if its kernels are compiled; loading takes a third."""


class Pipeline:
    """Computes readings from frames; picklable.

    Parameters
    ----------
    profile : Profile, str or Path
        A profile, its name, or the path of its YAML file.
    bundle : Bundle or Path, optional
        The unit's calibration. Without one, steps that need slopes are left out.
    reference : Reference, optional
        The undeformed sensor. Default: the bundle's reference.
    serial : str, optional
        The unit's serial number; a bundle of another unit is refused.
    compiled : bool, optional
        Whether steps and calibration use compiled loops; results are equal up to rounding.
        Default: True if the extra ``fast`` is installed and has compiled them; if it has not, a
        process of low priority begins to, for the next pipeline. Loading compiled loops takes
        about as long as they save over hundreds of frames.

    Raises
    ------
    ProfileError, PluginError
        The profile or one of its components is unusable.
    CalibrationError
        The bundle belongs to another sensor.
    InputError
        The reference does not match the profile.

    Attributes
    ----------
    given_reference : Reference or None
        The reference as it was given; None for the bundle's.
    """

    def __init__(
        self,
        profile: Profile | str | Path,
        bundle: Bundle | Path | None = None,
        reference: Reference | None = None,
        *,
        serial: str | None = None,
        compiled: bool | None = None,
    ) -> None:
        self.profile = profile if isinstance(profile, Profile) else load_profile(profile)
        self.bundle = bundle if isinstance(bundle, Bundle | None) else Bundle.load(bundle)
        self.serial = serial
        self.given_reference = reference
        notes: list[str] = []
        if self.bundle is not None:
            notes += self.bundle.check(self.profile, serial)
            reference = reference if reference is not None else self.bundle.reference
        self.compiled = self._is_compiled() if compiled is None else compiled
        self._calibration = self._prepared_calibration()
        if self._calibration is not None and not self._calibrated:
            notes.append("no bundle: slopes come from the lights as the profile gives them")
        if reference is not None:
            self._check(reference.pixels, "reference")
        calibration = self._calibration
        compensates = calibration is None or calibration.compensation == "channel"
        known = None if self.bundle is None else self.bundle.reference
        self.conditioning = Conditioning.of(
            self.profile,
            reference,
            compensates=compensates,
            known=known,
            compiled=self.compiled,
        )
        self.reference = self.conditioning.reference
        self._chain, markless = self._build_chain()
        self.reference = self._with_detections(self.reference)
        self._used = self._tares = False
        finder = self.conditioning.finder
        if finder is not None and self.reference is not None:
            miscounted = finder.miscounted(self.reference)
            notes += [miscounted] if miscounted else []
        if markless:
            notes.append(
                f"the gel has no markers, so these steps are left out: {', '.join(markless)}"
            )
        notes += left_out_notes(self._left_out(), bundled=self._calibrated)
        self.notes = tuple(notes)

    def frame(self, *images: Pixels, timestamp_s: float = 0.0, source: str = "") -> Frame:
        """Make a frame from camera images: crop, rectify and stack them as the profile specifies.

        Parameters
        ----------
        images : (H, W) or (H, W, 3) uint8 or uint16
            One raw camera image for each exposure of an observation, in order.
        timestamp_s : float
            Time at mid-observation.
        source : str
            Name of the observation, for messages and files.

        Raises
        ------
        InputError
            The number of images is wrong, or an image does not match the profile.
        """
        return self._assembly.frame(
            [Image(np.asarray(image), timestamp_s, source=source) for image in images]
        )

    @cached_property
    def _assembly(self) -> Assembly:
        return Assembly(make_lights(self.profile), self.profile.image)

    def process(self, frame: Frame, *inputs: Quantity, tare: bool = False) -> Reading:
        """Measure one frame.

        Parameters
        ----------
        frame : Frame
            (H, W, K), with the profile's size and channels.
        *inputs : Quantity
            External inputs of the steps, such as a robot's pose.
        tare : bool
            Subtract this frame's load from this reading and all later ones; see :meth:`tare`.

        Raises
        ------
        InputError
            The frame's size or channels differ from the profile's.
        """
        first, self._used = not self._used, True
        tare, self._tares = tare or self._tares, False
        start, start_of_thread_s = perf_counter(), thread_time() if first else 0.0
        self._check(frame.pixels, "frame")
        if is_sequential(frame) and self.bundle is not None:
            check_order(frame, self.bundle)
        raw, frame = frame, self.conditioning(frame)
        given: dict[type[Quantity], Quantity] = {type(value): value for value in inputs}
        given[Frame] = frame
        given |= self._fitted
        if self.reference is not None:
            given[Reference] = self.reference
        if self._calibration is not None and (self.reference is not None or not self._calibrated):
            measured = self._measured(self._calibration, frame)
            given[type(measured)] = measured
            if self.reference_gradients is not None:
                given[ReferenceGradients] = self.reference_gradients
        result = self._chain.run(given, tare=tare)
        not_measured = {Frame, Reference, ReferenceGradients, *self._chain.external, *self._fitted}
        measured_only = {k: v for k, v in result.by_type.items() if k not in not_measured}
        latency_ms = 1e3 * (perf_counter() - start)
        warnings = [*(self.notes if first else ()), *exposure_warnings(raw)]
        for name, kind in result.left_out.items():
            if kind in self._chain.external:
                warnings.append(not_given(name, kind))
            elif first and kind is Gradients and HeightMap in given:
                warnings.append(without_slopes(name))
        for kind, quantity in measured_only.items():
            if kind.warnings is not Quantity.warnings:
                with blame_of(quantity):
                    warnings += quantity.warnings()
        # not the latency: on a busy machine any frame may take seconds
        if first and self.compiled and thread_time() - start_of_thread_s > COMPILING_S:
            warnings.append(
                f"this frame took {latency_ms / 1e3:.0f} s, because the extra 'fast' compiled its "
                f"kernels; this happens once per installation"
            )
        return Reading(
            frame=frame,
            quantities=measured_only,
            steps=result.steps,
            inputs={type(value): value for value in inputs},
            latency_ms=latency_ms,
            relative=self.reference is not None and self.reference.relative,
            warnings=tuple(warnings),
        )

    def warm(self) -> None:
        """Load and compile now what the first frame would have to wait for.

        A copy of this pipeline measures a few made-up frames, in this thread. That takes about a
        second, or 45 when a pipeline with ``compiled=True`` compiles its kernels. Nothing else
        changes: not the tare, not what steps remember of earlier frames, and no result.
        """
        # a step may fail in any way; what matters is what it does with real frames
        with suppress(Exception):
            copy: Pipeline = pickle.loads(pickle.dumps(self))
            image = self.profile.image
            surface = self.reference or made_up_reference(image, self.channels)
            try:
                for frame in made_up_frames(surface, image.mm_per_px):
                    copy.process(frame)
            finally:
                copy.close()

    def map(self, frames: Iterable[Frame], *, workers: int = 1) -> Iterator[Reading]:
        """Measure frames in parallel processes and yield the readings in order.

        The first frame is measured in this process.

        Parameters
        ----------
        frames : iterable of Frame
            Consumed lazily.
        workers : int
            Number of processes; 1 measures in this process.

        Raises
        ------
        InputError
            There are several workers and a step depends on earlier frames.
        ChildProcessError
            A worker was killed.
        """
        in_order = [step.name for step in self.steps if step.estimator.stateful]
        if workers > 1 and in_order:
            raise InputError(
                f"{workers} workers cannot share these frames, because these steps depend on "
                f"earlier frames: {', '.join(in_order)}; use one worker, or a profile without "
                f"these steps"
            )
        left = iter(frames)
        for frame in islice(left, 1 if workers > 1 else None):
            yield self.process(frame)
        if workers > 1:
            yield from shared_out(self, left, workers)

    @property
    def tares(self) -> bool:
        """Whether the load of the next frame will be subtracted from then on."""
        return self._tares

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps of the profile's chain, in order."""
        return self._chain.steps

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of a frame's light channels, in order."""
        return tuple(make_lights(self.profile).channels)

    @property
    def gives(self) -> tuple[type[Quantity], ...]:
        """The types of quantity that a reading can contain."""
        measured = () if self._calibration is None else (Gradients, HeightMap)
        of_steps = (kind for step in self.steps for kind in step.gives)
        return tuple(dict.fromkeys([*measured, *of_steps]))

    @property
    def takes(self) -> frozenset[type[Quantity]]:
        """The external inputs that each frame needs for every step to run."""
        return self._chain.external

    def with_reference(self, reference: Reference) -> Pipeline:
        """Return a pipeline with another reference.

        It shares the steps of this pipeline, which keep their tare and the markers that they
        track.
        """
        other = Pipeline(
            self.profile, self.bundle, reference, serial=self.serial, compiled=self.compiled
        )
        other._chain, other._tares = self._chain, self._tares
        return other

    def close(self) -> None:
        """Release the resources of every step; the next frame acquires them again."""
        self._chain.close()

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._chain.reset()
        self._tares = False

    def resume(self) -> None:
        """Continue after frames are missing: reference and tare stay, tracking starts again."""
        self._chain.resume()

    def tare(self) -> None:
        """Subtract the load of the next frame from all later readings, until :meth:`reset`."""
        self._tares = True

    def _is_compiled(self) -> bool:
        """Whether the loops that this pipeline calls are compiled."""
        artefacts = {} if self.bundle is None else self.bundle.artefacts
        named = sorted((name, type(one).__qualname__) for name, one in artefacts.items())
        given = self.profile, self.bundle, self.given_reference, self.serial
        return already_compiled(f"{named} {self.profile.model_dump_json()}", partial(_warm, *given))

    def _build_chain(self) -> tuple[Chain, list[str]]:
        """Return the chain, and the names of the steps left out because the gel has no markers."""
        image, gel = self.profile.image, self.profile.gel
        if self.conditioning.finder is not None:
            gel = self.conditioning.finder.with_markers(gel, image.mm_per_px)
        context = SensorContext(image, gel, self.compiled)
        return chain_of(self.profile, made_steps(self.profile, context))

    def _with_detections(self, reference: Reference | None) -> Reference | None:
        """Add the markers of the undeformed gel, detected by the step that detects a frame's."""
        step = next((s for s in self._chain.steps if s.gives == (MarkerDetections,)), None)
        if reference is None or step is None or reference.detections is not None:
            return reference
        shown = reference.as_frame(self.profile.image.mm_per_px)
        given: dict[type[Quantity], Quantity] = {Frame: shown, Reference: reference}
        found = None if step.missing(given) else Chain({step.name: step.estimator}).run(given)
        with step.blamed():
            step.estimator.reset()
        detections = None if found is None else found.by_type[MarkerDetections]
        assert detections is None or isinstance(detections, MarkerDetections)
        return replace(reference, detections=detections)

    def _measured(self, calibration: Calibration, frame: Frame) -> Gradients | HeightMap:
        reference = self.reference
        if reference is None:
            even = np.full(frame.pixels.shape, frame.full_scale, np.float32)
            reference = Reference(even, frame.channels, frame.full_scale)
        measured = measured_by(calibration, frame, reference)
        if isinstance(measured, Gradients):
            errors = None if self.bundle is None else self.bundle.errors
            return measured if errors is None else errors.added_to(measured)
        if measured.rest_mm is None:
            # a light model has no access to the shape of the gel
            return replace(measured, rest_mm=self._rest_mm)
        return measured

    @cached_property
    def reference_gradients(self) -> ReferenceGradients | None:
        """The slopes that the calibration measures on the reference; None if no step takes them."""
        taken = any(ReferenceGradients in step.takes for step in self.steps)
        if self._calibration is None or self.reference is None or not taken:
            return None
        # its markers are found like a frame's, so that the reference as a frame has equal slopes
        shown = replace(self.reference.as_frame(self.profile.image.mm_per_px), marker_mask=None)
        return reference_gradients(self._calibration, self.conditioning(shown), self.reference)

    @cached_property
    def _rest_mm(self) -> Float32 | None:
        return SensorContext(self.profile.image, self.profile.gel).rest_mm

    @property
    def _calibrated(self) -> bool:
        """Whether the bundle has a light model; another one holds fitted steps alone."""
        return self.bundle is not None and self.bundle.calibration is not None

    @cached_property
    def _fitted(self) -> dict[type[Quantity], Quantity]:
        """The models of the bundle that steps can take."""
        artefacts = () if self.bundle is None else self.bundle.artefacts.values()
        return {type(one): one for one in artefacts if isinstance(one, Quantity)}

    def _uncalibrated(self) -> Calibration | None:
        lights = lights_of(make_lights(self.profile))
        return uncalibrated_by(calibrator_of(self.profile.calibration), lights)

    def _prepared_calibration(self) -> Calibration | None:
        found = None if self.bundle is None else self.bundle.calibration
        if found is None:
            found = self._uncalibrated()
        if found is None:
            return None
        with blame("the calibration", found):
            return found.prepared(compiled=self.compiled)

    def _left_out(self) -> dict[str, type[Quantity]]:
        """Return the steps that cannot run, each with the missing input that causes it."""
        given: set[type[Quantity]] = {Frame, *self._chain.external, *self._fitted}
        if self.reference is not None:
            given.add(Reference)
        if self._calibration is not None and (self.reference is not None or not self._calibrated):
            given |= {Gradients, HeightMap}
        left_out = self._chain.left_out(given)
        giver = {kind: step.name for step in self._chain.steps for kind in step.gives}
        for name, kind in left_out.items():
            while giver.get(kind) in left_out:
                kind = left_out[giver[kind]]
            left_out[name] = kind
        return left_out

    def _check(self, pixels: Pixels, what: str) -> None:
        check_size(pixels, what, self.profile)
        if self.bundle is not None:
            check_channels(pixels, what, self.bundle)


def _warm(
    profile: Profile, bundle: Bundle | None, reference: Reference | None, serial: str | None
) -> None:
    Pipeline(profile, bundle, reference, serial=serial, compiled=True).warm()
