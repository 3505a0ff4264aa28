"""Virtual presses with ground truth, few and small enough for a check.

The heights are those of an analytic ball; the illumination is that of the virtual sensor.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.conditioning.marker_finder import MarkerFinder
from tactile_core.errors import PluginError, TactileError
from tactile_core.interfaces.calibration import Press
from tactile_core.interfaces.component import SIMULATOR
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Markers
from tactile_core.interfaces.simulator import Renderer, Simulator
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    Gradients,
    HeightMap,
    MarkerDetections,
    MarkerField,
    Quantity,
    Reference,
    SlipState,
)
from tactile_core.testing.differences import CannotCheck

PRESSES = 7  # Number of presses for a calibration

SCENES = 4  # Number of presses in the sequence for estimators

_BALL = 0.4  # Diameter of a ball, as a share of the image's shorter side

_DEPTH = 0.2  # Indentation, as a share of the ball's diameter

_SHEAR = 0.03  # Shear displacement of the last press, as a share of the image's shorter side

_GENERIC = {
    "schema": 1,
    "name": "conformance",
    "image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1},
    "gel": {
        "thickness_mm": 2.0,
        "shear_modulus_mpa": 0.145,
        "poisson_ratio": 0.48,
        "friction": 0.5,
    },
}

S = TypeVar("S", bound=np.generic)


@dataclass(frozen=True, eq=False)
class VirtualPress:
    """One press and its ground truth.

    Attributes
    ----------
    frame : Frame
    press : BallPress
    height_mm : (H, W) float64
    gradients : (H, W, 2) float64
        ∂z/∂x and ∂z/∂y.
    contact : (H, W) bool
    truth : mapping of type to Quantity
        The ground truth as quantities, with the frame and the reference.
    """

    frame: Frame
    press: BallPress
    height_mm: NDArray[np.float64]
    gradients: NDArray[np.float64]
    contact: NDArray[np.bool_]
    truth: dict[type[Quantity], Quantity]


@dataclass(frozen=True, eq=False)
class Rig:
    """A virtual sensor of a profile."""

    profile: Profile

    @cached_property
    def optics(self) -> Renderer:
        """The illumination.

        Raises
        ------
        CannotCheck
            No simulator is installed.
        TactileError, ValueError
            The profile cannot be rendered.
        """
        return simulator().renderer(self.profile)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the K channels."""
        return self.optics.channels

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W) of the image."""
        return self.profile.image.height_px, self.profile.image.width_px

    @cached_property
    def reference(self) -> Reference:
        """Reference image of the undeformed sensor."""
        return Reference(
            _frozen(self.undeformed.pixels.astype(np.float32)),
            self.channels,
            self.optics.full_scale,
            self.undeformed.marker_mask,
            noise=1.0,
            detections=self._detections(self._markers_px),
        )

    @cached_property
    def undeformed(self) -> Frame:
        """A frame of the undeformed sensor."""
        return self._frame(np.zeros(self.shape), seed=0, number=0)

    @cached_property
    def context(self) -> SensorContext:
        """The context of estimators."""
        return SensorContext(self.profile.image, self.profile.gel)

    @cached_property
    def scenes(self) -> tuple[VirtualPress, ...]:
        """A short sequence of presses."""
        return tuple(self.scene(number) for number in range(SCENES))

    def scene(self, number: int) -> VirtualPress:
        """Return a held-out press; consecutive numbers give neighbouring positions."""
        height, width = self.shape
        centre = width * (0.42 + 0.03 * number), height * (0.55 - 0.02 * number)
        return self._scene(centre, _BALL, _DEPTH * (0.7 + 0.1 * number), 1000 + number, number)

    @cached_property
    def presses(self) -> tuple[Press, ...]:
        """Calibration presses: pixels of the contact, and a third of that number outside."""
        rng = np.random.default_rng(7)
        height, width = self.shape
        made = []
        for number in range(PRESSES):
            centre = rng.uniform(0.2, 0.8) * width, rng.uniform(0.2, 0.8) * height
            scene = self._scene(centre, _BALL, _DEPTH, number + 1, number)
            touched = rng.permutation(np.argwhere(scene.contact))[:300]  # [pixels] of a press
            flat = rng.permutation(np.argwhere(scene.height_mm < 0.01 * scene.height_mm.max()))
            rows, columns = np.concatenate([touched, flat[: len(touched) // 3]]).T
            slopes = scene.gradients[rows, columns].astype(np.float32)
            heights_mm = scene.height_mm[rows, columns].astype(np.float32)
            made.append(
                Press(
                    scene.frame,
                    rows.astype(np.int32),
                    columns.astype(np.int32),
                    slopes,
                    f"ball {number}",
                    heights_mm,
                )
            )
        return tuple(made)

    @cached_property
    def _markers_px(self) -> NDArray[np.float32]:
        """(N, 2) marker positions; a gel without markers gets some that are not rendered."""
        height, width = self.shape
        printed = self.profile.gel.markers
        pitch = min(self.shape) / 10  # pitches along the shorter side
        if isinstance(printed, Markers):
            pitch = printed.pitch_mm / self.profile.image.mm_per_px
        x, y = (np.arange(pitch, side - pitch / 2, pitch) for side in (width, height))
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2).astype(np.float32)

    def _detections(self, places_px: NDArray[np.float32], time_s: float = 0.0) -> MarkerDetections:
        return MarkerDetections(_frozen(places_px), np.zeros(len(places_px), np.bool_), time_s)

    def _sheared_px(
        self, centre: tuple[float, float], number: int, places_px: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(…, 2) shear displacement in px of the surface now at these places."""
        far = np.square(places_px - np.array(centre)).sum(axis=-1, keepdims=True)
        reach = 0.4 * min(self.shape)  # [shorter sides] the shear decays
        shear = np.array([1.0, 0.4]) * _SHEAR * (number + 1) / SCENES * min(self.shape)
        return np.asarray(np.exp(-far / reach**2) * shear)

    def _shear_markers(
        self, centre: tuple[float, float], number: int, time_s: float
    ) -> dict[type[Quantity], Quantity]:
        """Return the true markers and displacements when a sticking object at ``centre`` shears."""
        scale, count = self.profile.image.mm_per_px, len(self._markers_px)
        markers = undeformed = self._markers_px.astype(np.float64)
        for _ in range(10):
            markers = undeformed + self._sheared_px(centre, number, markers)
        px = _frozen(markers.astype(np.float32))
        grid = np.moveaxis(np.indices(self.shape)[::-1], 0, -1).astype(np.float64)
        field_mm = (self._sheared_px(centre, number, grid) * scale).astype(np.float32)
        everywhere = _frozen(np.ones(self.shape, np.bool_))
        all_seen = np.ones(count, np.bool_)
        ids = np.arange(count, dtype=np.int32)
        return {
            MarkerDetections: self._detections(px, time_s),
            MarkerField: MarkerField(ids, self._markers_px, px, all_seen, scale, time_s),
            DisplacementField: DisplacementField(_frozen(field_mm), everywhere, scale, time_s),
            SlipState: SlipState("stick", 0.0, timestamp_s=time_s),
        }

    def _scene(
        self, centre: tuple[float, float], ball: float, depth: float, seed: int, number: int
    ) -> VirtualPress:
        scale = self.profile.image.mm_per_px
        diameter_mm = ball * min(self.shape) * scale
        press = BallPress(centre, diameter_mm, depth * diameter_mm)
        height_mm = press.height_mm(self.shape, scale)
        frame = self._frame(height_mm, seed, number)
        gy, gx = np.gradient(height_mm, scale)
        contact = _frozen(height_mm > height_mm.max() - press.depth_mm)
        valid = _frozen(np.ones(self.shape, np.bool_))
        x, y, z = (_frozen(np.asarray(a, np.float32)) for a in (gx, gy, height_mm))
        time_s, rest_mm = frame.timestamp_s, self.context.rest_mm
        truth: dict[type[Quantity], Quantity] = {
            Frame: frame,
            Reference: self.reference,
            Gradients: Gradients(x, y, valid, scale, time_s),
            HeightMap: HeightMap(z, valid, scale, time_s, rest_mm),
            ContactMask: ContactMask(contact, scale, time_s),
            **self._shear_markers(centre, number, time_s),
        }
        return VirtualPress(frame, press, height_mm, np.stack([gx, gy], -1), contact, truth)

    def _frame(self, height_mm: NDArray[np.float64], seed: int, number: int) -> Frame:
        frame = self.optics.take_frame(height_mm, number=seed, time_s=10 + number / 30)
        pixels = _frozen(frame.pixels.copy())
        printed = isinstance(self.profile.gel.markers, Markers)
        finder = MarkerFinder.for_gel(self.profile) if printed else None
        return replace(
            frame,
            pixels=pixels,
            marker_mask=None if finder is None else _frozen(finder.find(pixels)),
            wall_time_s=1e9 + number / 30,
            sequence=number,
            source="",
        )


def _frozen(array: NDArray[S]) -> NDArray[S]:
    """Make an array read-only, also through the base of a view."""
    array.flags.writeable = False
    return array


def simulator() -> Simulator:
    """Return what renders virtual presses.

    Raises
    ------
    CannotCheck
        None is installed.
    """
    try:
        return resolve("simulator", SIMULATOR)()
    except PluginError as error:
        raise CannotCheck(f"left out without a simulator: {error}") from error


def full_rig(profile: Profile) -> Rig | None:
    """Return the virtual sensor at the profile's size; None if it cannot be rendered."""
    rig = Rig(profile)
    with suppress(CannotCheck):
        try:
            _ = rig.optics
        except (TactileError, ValueError):
            return None
    return rig


def small_rig(profile: Profile) -> Rig | None:
    """Return the virtual sensor with fewer and larger pixels and without markers."""
    image = profile.image
    factor = min(1.0, 160 / max(image.width_px, image.height_px))  # [px] longer side
    size = {
        "width_px": round(image.width_px * factor),
        "height_px": round(image.height_px * factor),
        "mm_per_px": image.mm_per_px / factor,
    }
    gel = profile.gel.model_copy(update={"markers": None})
    small = profile.model_copy(update={"image": image.model_copy(update=size), "gel": gel})
    return full_rig(small)


def generic_rig() -> Rig:
    """Return a virtual sensor with three colours, for plugins without an illumination."""
    return Rig(Profile.model_validate(_GENERIC))
