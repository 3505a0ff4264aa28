"""The parts of a pipeline: the steps of a profile, made and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tactile_core.acquisition.devices import lights_of, make_lights
from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.bundles.bundle import Bundle
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.calibration import Calibration
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.interfaces.gel import Markers
from tactile_core.pipeline.chain import Chain, without_markers
from tactile_core.pipeline.frame_check import check_pixels
from tactile_core.pipeline.health import left_out_notes
from tactile_core.plugins.blame import blame
from tactile_core.plugins.options import (
    calibrator_of,
    measured_by,
    options_of,
    reference_gradients,
    uncalibrated_by,
)
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    Float32,
    Frame,
    Gradients,
    HeightMap,
    MarkerDetections,
    Quantity,
    Reference,
    ReferenceGradients,
)

if TYPE_CHECKING:
    from tactile_core.conditioning.gel_check import GelCheck

# Quantities that can come with a calibrated unit's frame; some calibrations return height.
_EVER_GIVEN: frozenset[type[Quantity]] = frozenset({Frame, Reference, Gradients, HeightMap})


def check_steps(profile: Profile) -> None:
    """Check that the steps of a profile form a chain, and that the profile gives what they need.

    Raises
    ------
    PluginError, ProfileError, InputError
        As for a :class:`Pipeline` of this profile.
    """
    gel = profile.gel
    if gel.markers == "auto":  # without the reference in which they are measured, any size will do
        mm_per_px = profile.image.mm_per_px
        stand_in = Markers(pitch_mm=20 * mm_per_px, diameter_mm=8 * mm_per_px)
        gel = gel.model_copy(update={"markers": stand_in})
    chain_of(profile, made_steps(profile, SensorContext(profile.image, gel)))


def made_steps(profile: Profile, context: SensorContext) -> dict[str, Estimator]:
    """Return the estimators of a profile by their names."""
    steps = {}
    for name, component in profile.estimators.items():
        kind = resolve("estimator", component.use)
        with blame(f"step {name!r}", kind):
            steps[name] = kind(options_of(kind, component), context)
    return steps


def chain_of(profile: Profile, steps: Mapping[str, Estimator]) -> tuple[Chain, list[str]]:
    """Return the chain, and the names of the steps left out because the gel has no markers."""
    markless = without_markers(steps) if profile.gel.markers is None else []
    chain = Chain({name: step for name, step in steps.items() if name not in markless})
    chain.check(_EVER_GIVEN)
    return chain, markless


@dataclass(frozen=True)
class PipelineParts:
    """What turns a frame into a reading, made of a profile, a bundle and a reference.

    Attributes
    ----------
    profile : Profile
    bundle : Bundle or None
    calibration : Calibration or None
        The light model of the bundle, or that of the lights as the profile gives them.
    conditioning : Conditioning
    reference : Reference or None
        Conditioned, with its markers.
    chain : Chain
    notes : tuple of str
        What is unusual about them.
    """

    profile: Profile
    bundle: Bundle | None
    calibration: Calibration | None
    conditioning: Conditioning
    reference: Reference | None
    chain: Chain
    notes: tuple[str, ...]

    @classmethod
    def from_profile(
        cls,
        profile: Profile,
        bundle: Bundle | None,
        reference: Reference | None,
    ) -> PipelineParts:
        """Make the parts; the arguments are those of a :class:`Pipeline`.

        Raises
        ------
        PluginError, CalibrationError, InputError
            As a :class:`Pipeline` raises them.
        """
        notes: list[str] = []
        if bundle is not None and reference is None:
            reference = bundle.reference
        calibration = _light_model(profile, bundle)
        if calibration is not None and not _has_light_model(bundle):
            notes.append("no bundle: slopes come from the lights as the profile gives them")
        if reference is not None:
            check_pixels(reference.pixels, "reference", profile, bundle)
        conditioning = Conditioning.for_build(
            profile,
            reference,
            compensates=calibration is None or calibration.compensation == "channel",
            known=None if bundle is None else bundle.reference,
        )
        chain, markless = _chain(profile, conditioning)
        completed = _with_detections(conditioning.reference, chain, profile)
        parts = cls(profile, bundle, calibration, conditioning, completed, chain, ())
        finder = conditioning.finder
        if finder is not None and completed is not None:
            miscounted = finder.explain_miscount(completed)
            notes += [miscounted] if miscounted else []
        if markless:
            notes.append(
                f"the gel has no markers, so these steps are left out: {', '.join(markless)}"
            )
        notes += parts.of_another_gel
        notes += left_out_notes(parts.left_out, bundled=_has_light_model(bundle))
        return replace(parts, notes=tuple(notes))

    @property
    def measures(self) -> bool:
        """Whether a frame alone gives slopes or heights."""
        uncalibrated = not _has_light_model(self.bundle)
        return self.calibration is not None and (self.reference is not None or uncalibrated)

    def measure_surface(self, frame: Frame) -> Gradients | HeightMap:
        """Measure the slopes or heights of a conditioned frame, if there is a calibration."""
        assert self.calibration is not None
        reference = self.reference
        if reference is None:
            even = np.full(frame.pixels.shape, frame.full_scale, np.float32)
            reference = Reference(even, frame.channels, frame.full_scale)
        measured = measured_by(self.calibration, frame, reference)
        if isinstance(measured, Gradients):
            errors = None if self.bundle is None else self.bundle.errors
            return measured if errors is None else errors.added_to(measured)
        if measured.rest_mm is None:
            # a light model has no access to the shape of the gel
            return replace(measured, rest_mm=self._rest_mm)
        return measured

    @cached_property
    def gel_check(self) -> GelCheck | None:
        """Compares frames with the reference; None without one, or without any photometry."""
        if self.conditioning.reference is None or calibrator_of(self.profile.calibration).refusal:
            return None
        from tactile_core.conditioning.gel_check import GelCheck

        light = None if self.bundle is None else self.bundle.manifest.light_range
        view = ImageGeometry(self.profile.image).view()
        compensated = light is not None and self.conditioning.compensates
        return GelCheck(self.conditioning.reference, light, compensated, view)

    @cached_property
    def _todays_reference(self) -> tuple[GelCheck, Frame] | None:
        """A reference that is not the bundle's, conditioned against that; and its check."""
        given, bundle, check = self.conditioning.reference, self.bundle, self.gel_check
        held = None if bundle is None else bundle.reference
        if bundle is None or held is None or given is None or check is None:
            return None
        if given.pixels is held.pixels:
            return None
        calibrated = self.conditioning.with_reference(held)
        today = replace(given.as_frame(bundle.manifest.mm_per_px), marker_mask=given.marker_mask)
        return replace(check, reference=calibrated.undeformed), calibrated.compensate_drift(today)

    @property
    def of_another_gel(self) -> list[str]:
        """Whether a reference of today shows another gel, or other light, than the bundle's."""
        if self._todays_reference is None:
            return []
        check, today = self._todays_reference
        shown = check(today)
        words = f"the reference does not show the gel of the bundle: {shown.advice}"
        return [] if shown.this_gel else [words]

    def drift(self, frame: Frame) -> tuple[str, bool]:
        """Return how far the light drifted from the bundle's, in words, and if that is too far.

        It is taken from today's reference, or else from a frame.
        """
        if self.bundle is None or self.gel_check is None:
            return "", False
        check, today = self._todays_reference or (self.gel_check, frame)
        return check.drift_in_words(today), not check(today).this_gel

    @cached_property
    def reference_gradients(self) -> ReferenceGradients | None:
        """The slopes that the calibration measures on the reference; None if no step takes them."""
        taken = any(ReferenceGradients in step.takes for step in self.chain.steps)
        if self.calibration is None or self.reference is None or not taken:
            return None
        # its markers are found like a frame's, so that the reference as a frame has equal slopes
        shown = replace(self.reference.as_frame(self.profile.image.mm_per_px), marker_mask=None)
        return reference_gradients(self.calibration, self.conditioning(shown), self.reference)

    @cached_property
    def fitted(self) -> dict[type[Quantity], Quantity]:
        """The models of the bundle that steps can take."""
        artefacts = () if self.bundle is None else self.bundle.artefacts.values()
        return {type(one): one for one in artefacts if isinstance(one, Quantity)}

    @cached_property
    def _rest_mm(self) -> Float32 | None:
        return SensorContext(self.profile.image, self.profile.gel).rest_mm

    @cached_property
    def left_out(self) -> Mapping[str, type[Quantity]]:
        """The steps that cannot run, each with the missing input that causes it."""
        given: set[type[Quantity]] = {Frame, *self.chain.external, *self.fitted}
        if self.reference is not None:
            given.add(Reference)
        if self.measures:
            given |= {Gradients, HeightMap}
        left_out = self.chain.left_out(given)
        giver = {kind: step.name for step in self.chain.steps for kind in step.gives}
        for name, kind in left_out.items():
            while giver.get(kind) in left_out:
                kind = left_out[giver[kind]]
            left_out[name] = kind
        return left_out


def _has_light_model(bundle: Bundle | None) -> bool:
    """Whether the bundle has a light model; another one holds fitted steps alone."""
    return bundle is not None and bundle.calibration is not None


def _light_model(profile: Profile, bundle: Bundle | None) -> Calibration | None:
    if bundle is not None and bundle.calibration is not None:
        return bundle.calibration
    lights = lights_of(make_lights(profile))
    return uncalibrated_by(calibrator_of(profile.calibration), lights)


def _chain(profile: Profile, conditioning: Conditioning) -> tuple[Chain, list[str]]:
    """Return the chain, and the names of the steps left out because the gel has no markers."""
    gel = profile.gel
    if conditioning.finder is not None:
        gel = conditioning.finder.with_markers(gel, profile.image.mm_per_px)
    return chain_of(profile, made_steps(profile, SensorContext(profile.image, gel)))


def _with_detections(
    reference: Reference | None, chain: Chain, profile: Profile
) -> Reference | None:
    """Add the markers of the undeformed gel, detected by the step that detects a frame's."""
    step = next((step for step in chain.steps if step.gives == (MarkerDetections,)), None)
    if reference is None or step is None or reference.detections is not None:
        return reference
    shown = reference.as_frame(profile.image.mm_per_px)
    given: dict[type[Quantity], Quantity] = {Frame: shown, Reference: reference}
    found = None if step.missing(given) else Chain({step.name: step.estimator}).run(given)
    with step.blame_step():
        step.estimator.reset()
    detections = None if found is None else found.by_type[MarkerDetections]
    assert detections is None or isinstance(detections, MarkerDetections)
    return replace(reference, detections=detections)
