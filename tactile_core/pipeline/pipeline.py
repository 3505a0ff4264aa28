"""Computes readings from frames with a profile, a bundle and a reference; needs no device."""

from __future__ import annotations

import gc
import pickle
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from tactile_core.acquisition.assembly import Assembly
from tactile_core.acquisition.devices import make_lights
from tactile_core.bundles.bundle import Bundle
from tactile_core.conditioning.conditioning import is_sequential
from tactile_core.errors import InputError
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.chain import Step
from tactile_core.pipeline.frame_check import check_order, check_pixels, check_reference
from tactile_core.pipeline.health import exposure_warnings, not_given, without_slopes
from tactile_core.pipeline.parts import PipelineParts
from tactile_core.plugins.blame import blame_of
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    Frame,
    Gradients,
    HeightMap,
    Image,
    Pixels,
    Quantity,
    Reference,
    ReferenceGradients,
    ShownGel,
)
from tactile_core.quantities.quantity import grid_of

if TYPE_CHECKING:
    from tactile_core.conditioning.gel_check import GelCheck


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
        bundle: Bundle | Path | str | None = None,
        reference: Reference | None = None,
        *,
        serial: str | None = None,
    ) -> None:
        self.profile = profile if isinstance(profile, Profile) else load_profile(profile)
        self.bundle = bundle if isinstance(bundle, Bundle | None) else Bundle.load(Path(bundle))
        self.serial = serial
        check_reference(reference)
        self.given_reference = reference
        of_bundle = () if self.bundle is None else self.bundle.check(self.profile, serial)
        self._parts = PipelineParts.from_profile(self.profile, self.bundle, reference)
        self._chain = self._parts.chain
        self.conditioning = self._parts.conditioning
        self.reference = self._parts.reference
        self.notes = (*of_bundle, *self._parts.notes)
        # each reading says that its height is coarse
        coarse = self.bundle is not None and bool(self.bundle.manifest.starting)
        self._lasting = tuple(of_bundle) if coarse else ()
        self._used = self._tares = False

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

    def drift(self, frame: Frame) -> tuple[str, bool]:
        """Return how far the light drifted since the calibration, in words, and if it is too far.

        It is taken from today's reference, or else from a frame; without a bundle, no words.
        """
        return self._parts.drift(frame)

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
        if not isinstance(frame, Frame):
            raise InputError(
                f"process() takes a Frame, not {type(frame).__name__}; make one of your own image "
                f"with pipeline.frame(image)"
            )
        first, self._used = not self._used, True
        tare, self._tares = tare or self._tares, False
        start = perf_counter()
        check_pixels(frame.pixels, "frame", self.profile, self.bundle)
        if is_sequential(frame) and self.bundle is not None:
            check_order(frame, self.bundle)
        raw, frame = frame, self.conditioning(frame)
        given: dict[type[Quantity], Quantity] = {type(value): value for value in inputs}
        given[Frame] = frame
        given |= self._parts.fitted
        if self.reference is not None:
            given[Reference] = self.reference
        if self.gel_check is not None:
            given[ShownGel] = self.gel_check(frame)
        if self._parts.measures:
            measured = self._parts.measure_surface(frame)
            given[type(measured)] = measured
            if self.reference_gradients is not None:
                given[ReferenceGradients] = self.reference_gradients
        result = self._chain.run(given, tare=tare)
        external, fitted = self._chain.external, self._parts.fitted
        not_measured = {Frame, Reference, ReferenceGradients, *external, *fitted}
        measured_only = {k: v for k, v in result.by_type.items() if k not in not_measured}
        height = measured_only.get(HeightMap)
        if isinstance(height, HeightMap) and self._is_impossible(height):
            shown = measured_only.get(ShownGel)
            if not isinstance(shown, ShownGel) or shown.this_gel:
                measured_only[ShownGel] = ShownGel(False, "unknown", frame.timestamp_s)
        latency_ms = 1e3 * (perf_counter() - start)
        warnings = [
            *(self.notes if first else self._lasting),
            *exposure_warnings(raw, self.reference),
        ]
        for name, kind in result.left_out.items():
            if kind in external:
                warnings.append(not_given(name, kind))
            elif first and kind is Gradients and HeightMap in given:
                warnings.append(without_slopes(name))
        for kind, quantity in measured_only.items():
            if kind.warnings is not Quantity.warnings:
                with blame_of(quantity):
                    warnings += quantity.warnings()
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
        """Load now what the first frame would have to wait for.

        A copy of this pipeline measures a few made-up frames, in this thread. That takes about a
        second. Nothing else changes: not the tare, not what steps remember of earlier frames, and
        no result.
        """
        from tactile_core.pipeline.made_up_frames import made_up_frames, made_up_reference

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
        # loading made many objects; looking through them would delay some later frame by 80 ms
        gc.collect()

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
            from tactile_core.pipeline.workers import shared_out

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
        measured = (Gradients, HeightMap) if self._parts.measures else ()
        run = (step for step in self.steps if step.name not in self._parts.left_out)
        return tuple(dict.fromkeys([*measured, *(kind for step in run for kind in step.gives)]))

    @property
    def reference_gradients(self) -> ReferenceGradients | None:
        """The slopes that the calibration measures on the reference; None if no step takes them."""
        return self._parts.reference_gradients

    @property
    def gel_check(self) -> GelCheck | None:
        """What compares frames with the reference; None without one."""
        return self._parts.gel_check

    @property
    def takes(self) -> frozenset[type[Quantity]]:
        """The external inputs that each frame needs for every step to run."""
        return self._chain.external

    def with_reference(self, reference: Reference) -> Pipeline:
        """Return a pipeline with another reference.

        It shares the steps of this pipeline, which keep their tare and the markers that they
        track.
        """
        other = Pipeline(self.profile, self.bundle, reference, serial=self.serial)
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

    def _is_impossible(self, height: HeightMap) -> bool:
        """Whether a height is more than the gel is thick, or a bulge that it cannot form."""
        thickness_mm = self.profile.gel.thickness_mm
        if thickness_mm is None:
            return False
        cells_mm = grid_of(height, "mm").cells  # the map of every pixel costs as much as a step
        # [thicknesses] beside a contact virtual gels rise a third as much
        return bool(cells_mm.max() > thickness_mm or cells_mm.min() < -0.5 * thickness_mm)
