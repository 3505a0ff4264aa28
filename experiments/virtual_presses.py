"""Ball presses on virtual units that differ in light, coating, gel and camera, with their truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.force.elastic_layer import ElasticLayer, Elastomer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_core.calibration.presses import FoundPress
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.interfaces.gel import LightBuild
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_sim.gel import SoftGel
from tactile_sim.normal_contact import solve_normal
from tactile_sim.optics.lights import LedArray, light_field
from tactile_sim.optics.rig import RigOptics

Array = NDArray[Any]


class UnitParameters(NamedTuple):
    """Parameters of the virtual units. Nothing sets them from outside: they define the proxy.

    Attributes
    ----------
    presses : int, count
        Presses of a unit.
    depths : int, count
        Different depths of the presses of one ball; each is solved once.
    cut_share : float, share
        Share of the presses whose contact the image border cuts.
    spacing_balls : float, ball radii
        Spacing of the nodes on which the contact is solved.
    fall_off : float, ratio
        Light at the bright side over that at the dark side.
    """

    presses: int = 24
    depths: int = 5
    cut_share: float = 0.2
    spacing_balls: float = 0.015
    fall_off: float = 10.0


UNIT = UnitParameters()


@dataclass(frozen=True, eq=False)
class VirtualPress:
    """A press and its truth.

    Attributes
    ----------
    frame : Frame
    ball_px, centre_px, contact_px
        Radius of the ball, and centre and radius of its contact.
    cut : bool
        The image border cuts the contact.
    """

    frame: Frame
    ball_px: float
    centre_px: tuple[float, float]
    contact_px: float
    cut: bool


@dataclass(frozen=True, eq=False)
class VirtualUnit:
    """Reference and presses of one virtual unit.

    Attributes
    ----------
    expose : callable
        Returns the conditioned frame with a number of a height (H, W) in mm.
    """

    name: str
    reference: Reference
    presses: Sequence[VirtualPress]
    expose: Callable[[Array, int], Frame]

    def found_presses(self, thickness_mm: float) -> list[FoundPress]:
        """Return the presses that the border does not cut, with their true circles."""
        return [
            FoundPress(
                "",
                press.frame,
                Circle(press.centre_px, press.contact_px),
                press.ball_px,
                thickness_mm=thickness_mm,
            )
            for press in self.presses
            if not press.cut
        ]


@dataclass(frozen=True, eq=False)
class Imprint:
    """Axisymmetric indentation of a gel by a ball."""

    profile: CubicSpline
    reach_mm: float
    contact_mm: float

    @classmethod
    def of(cls, elastomer: Elastomer, ball_mm: float, depth_mm: float) -> Imprint:
        """Solve the contact of a ball of this radius on an elastic layer bonded to a plate."""
        side = 4 * ball_mm + 4 * min(elastomer.thickness_mm, ball_mm)
        grid = SurfaceGrid.covering(side, side, UNIT.spacing_balls * ball_mm)
        i, j = grid.ny // 2, grid.nx // 2
        square = (grid.x_mm - grid.x_mm[j]) ** 2 + (grid.y_mm - grid.y_mm[i])[:, None] ** 2
        overlap = depth_mm - ball_mm + np.sqrt(np.maximum(ball_mm**2 - square, 0))
        overlap = overlap.astype(np.float32)
        layer = ElasticLayer(grid, elastomer)
        pressure = solve_normal(layer.indentation, overlap, np.zeros_like(overlap)).pressure
        height = layer.indentation(pressure)[i, j:].astype(float)
        r = np.arange(len(height)) * grid.spacing_mm
        height = height - height[-1]
        contact_mm = float(np.sqrt(np.count_nonzero(pressure > 0) * grid.cell_mm2 / np.pi))
        spline = CubicSpline(np.r_[-r[:0:-1], r], np.r_[height[:0:-1], height])
        return cls(spline, float(r[-1]), contact_mm)

    def height_mm(
        self, shape: tuple[int, int], mm_per_px: float, centre_px: tuple[float, float]
    ) -> Array:
        """(H, W) height of the gel surface of an image."""
        x, y = np.arange(shape[1]) - centre_px[0], np.arange(shape[0])[:, None] - centre_px[1]
        r = np.hypot(x, y) * mm_per_px
        return np.where(r < self.reach_mm, self.profile(np.minimum(r, self.reach_mm)), 0.0)


Expose = Callable[[Array, int], Array]
"""Renders the frame with this number of a height in mm."""


def unit_of(
    name: str, profile: Profile, expose: Expose, balls_mm: Sequence[float], seed: int
) -> VirtualUnit:
    """Press balls of these radii all over a unit, in equal numbers and at random depths."""
    rng = np.random.default_rng([seed, 7])
    section = profile.image
    shape = section.height_px, section.width_px
    elastomer = SoftGel.from_gel(profile.gel).elastomer

    def frame(height_mm: Array, number: int) -> Frame:
        pixels = expose(height_mm, number)
        channels = tuple("abcdef"[: pixels.shape[2]])
        return Frame(pixels, channels, section.mm_per_px, source=f"{number}")

    flat = frame(np.zeros(shape), 10_000)
    given = Reference(flat.pixels.astype(np.float32), flat.channels, flat.full_scale)
    condition = Conditioning.for_build(profile, given, compensates=False)
    assert condition.reference is not None

    def exposed(height_mm: Array, number: int) -> Frame:
        return condition(frame(height_mm, number))

    imprints = []
    for ball_mm in balls_mm:
        shares = np.linspace(0.45, 0.75, UNIT.depths)
        for share in shares:
            thick = elastomer.thickness_mm
            # between (share R)² / R on a half-space and half of it on a thin layer
            depth = min(0.75 * share**2 * ball_mm, 0.8 * thick)
            imprints.append((ball_mm, Imprint.of(elastomer, ball_mm, depth)))
    presses = []
    for number in range(UNIT.presses):
        ball_mm, imprint = imprints[int(rng.integers(len(imprints)))]
        contact_px = imprint.contact_mm / section.mm_per_px
        cut = number < UNIT.cut_share * UNIT.presses
        centre = _somewhere(rng, shape, contact_px, cut)
        height = imprint.height_mm(shape, section.mm_per_px, centre)
        taken = exposed(height, number)
        presses.append(VirtualPress(taken, ball_mm / section.mm_per_px, centre, contact_px, cut))
    return VirtualUnit(name, condition.reference, presses, exposed)


def _somewhere(
    rng: np.random.Generator, shape: tuple[int, int], contact_px: float, cut: bool
) -> tuple[float, float]:
    h, w = shape
    margin = contact_px + 1
    x, y = (float(rng.uniform(margin, side - 1 - margin)) for side in (w, h))
    if cut:
        # the border takes up to half of the contact
        inside = float(rng.uniform(0, 0.9)) * contact_px
        border = int(rng.integers(4))
        if border < 2:
            x = inside if border else w - 1 - inside
        else:
            y = inside if border == 2 else h - 1 - inside
    return x, y


def with_fall_off(seed: int, balls_mm: Sequence[float] = (2.0,)) -> VirtualUnit:
    """A unit like a GelSight Mini whose light falls by ten across the image."""
    rng = np.random.default_rng([seed, 1])
    scale = float(rng.uniform(0.065, 0.085))
    linear = bool(rng.integers(2))
    start = float(rng.uniform(0, 360))
    # lights all around, or on one side: then all channels are dark on the other
    spread = 120.0 if rng.integers(2) else float(rng.uniform(20, 50))
    elevation = float(rng.uniform(20, 50))
    azimuths = [start + spread * k for k in (-1, 0, 1)]
    lights = [
        {
            "name": name,
            "azimuth_deg": azimuth % 360,
            "elevation_deg": elevation,
            "distance_mm": _distance_mm(azimuth, elevation, scale),
        }
        for name, azimuth in zip(("red", "green", "blue"), azimuths, strict=True)
    ]
    tree = {
        "schema": 1,
        "name": "fall_off",
        "description": "virtual unit",
        "image": {
            "width_px": 320,
            "height_px": 240,
            "mm_per_px": scale,
            "transfer": "linear" if linear else "gamma",
        },
        "gel": {
            "thickness_mm": float(rng.uniform(2, 4.5)),
            "coating": str(rng.choice(["matte", "semi_specular"])),
        },
        "illumination": {"use": "core.constant", "lights": lights},
        "optics": {
            "lights": {"scatter": 0.0, "spread": 0.2},
            "ambient": float(rng.uniform(0.0, 0.05)),
            "coat": {"grain": float(rng.uniform(0.005, 0.02))},
            "sensor": {
                "exposure": float(rng.uniform(0.15, 0.28) if linear else rng.uniform(0.3, 0.5)),
                "vignetting": float(rng.uniform(0, 0.3)),
                "crosstalk": float(rng.uniform(0, 0.15)),
                "full_well_e": float(rng.uniform(5e3, 2e4)),
                "jpeg_quality": [70, 85, 95, "none"][int(rng.integers(4))],
            },
        },
    }
    profile = Profile.model_validate(tree)
    rig = RigOptics(profile, seed=seed)
    return unit_of(f"fall_off {seed}", profile, lambda z, n: rig.expose(z, frame=n), balls_mm, seed)


def _distance_mm(azimuth_deg: float, elevation_deg: float, mm_per_px: float) -> float:
    """Distance at which a light's irradiance of 320 × 240 px falls by ten."""

    def excess(distance_mm: float) -> float:
        led_array = LedArray(
            "light", azimuth_deg, elevation_deg, distance_mm, (), LightBuild(lobe_deg=120)
        )
        flat = light_field(led_array, (240, 320), mm_per_px=mm_per_px)[2]
        bright, dark = np.quantile(flat, (0.98, 0.02))
        return float(np.log(bright / dark / UNIT.fall_off))

    return float(brentq(excess, 12.0, 150.0, xtol=0.1))


AT_HAND = {
    "desktop_three_colour": 5.0,
    "hex_fingertip": 1.98,
    "hex_fingertip_unmarked": 1.98,
    "baxter_fingertip_flat": 2.5,
    "desktop_six_led": 0.8,
}
"""Shipped profiles, and the radius in mm of a ball that suits each."""


def at_hand(name: str, seed: int) -> VirtualUnit:
    """A unit of a shipped rig."""
    profile = load_profile(name)
    rig = RigOptics(profile, seed=seed)
    return unit_of(
        f"{name} {seed}", profile, lambda z, n: rig.expose(z, frame=n), (AT_HAND[name],), seed
    )


def darkening(seed: int) -> VirtualUnit:
    """A unit without directional light, whose image darkens with depth."""
    rng = np.random.default_rng([seed, 2])
    shape = (345, 460)
    tree = {
        "schema": 1,
        "name": "darkening",
        "description": "virtual unit",
        "image": {"width_px": shape[1], "height_px": shape[0], "mm_per_px": 0.051},
        "gel": {"thickness_mm": float(rng.uniform(2, 4))},
        "illumination": {"use": "core.constant"},
    }
    profile = Profile.model_validate(tree)
    y, x = np.mgrid[: shape[0], : shape[1]] / shape[1] - 0.5
    direction, steep = rng.uniform(0, 2 * np.pi), rng.uniform(0, 1.2)
    light = np.exp(steep * (x * np.cos(direction) + y * np.sin(direction)) - (x**2 + y**2))
    tint = rng.uniform(0.7, 1.0, 3) if rng.integers(2) else np.ones(3)
    level, opaque = rng.uniform(90, 170), rng.uniform(0.6, 1.0)
    decay_mm = rng.uniform(0.8, 2.5)
    lean = rng.uniform(-0.05, 0.05, 2)
    noise, quality = rng.uniform(0.5, 2.0), [None, 80, 95][int(rng.integers(3))]

    def expose(height_mm: Array, number: int) -> Array:
        slope_y, slope_x = np.gradient(height_mm, 0.051)
        seen = 1 - opaque + opaque * np.exp(-np.clip(height_mm, -0.2, None) / decay_mm)
        seen = seen * (1 + lean[0] * slope_x + lean[1] * slope_y)
        values = level * (light * seen)[..., None] * tint
        values += np.random.default_rng([seed, number]).normal(0, noise, values.shape)
        pixels = np.clip(np.rint(values), 0, 255).astype(np.uint8)
        if quality is not None:
            _, packed = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
            pixels = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
        return np.asarray(pixels)

    return unit_of(f"darkening {seed}", profile, expose, (float(rng.uniform(3, 4.5)),), seed)


KINDS: dict[str, Callable[[int], VirtualUnit]] = {
    "fall_off": with_fall_off,
    "two_balls": lambda seed: with_fall_off(seed, (2.0, 3.2)),
    "darkening": darkening,
    "at_hand": lambda seed: at_hand([*AT_HAND][seed % len(AT_HAND)], seed),
}
"""The unit of each kind with a seed."""
