"""The virtual stage: one unit of a sensor, pressed and moved by commands."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.errors import InputError
from tactile_core.interfaces.component import Lighting, SensorBuild
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.gel import Gel, Markers, Optics
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Pixels
from tactile_sim.gel import FRICTION
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.modes import Mode
from tactile_sim.optics.faults import Faults
from tactile_sim.optics.markers import reflectance_of_ink
from tactile_sim.optics.rig import RigOptics
from tactile_sim.optics.sources import Coating


class VirtualStage(GelSurface):
    """Virtual sensor of a profile, with an object that presses and moves on its gel surface.

    Increments are quasi-static (all stress relaxes) unless they are given seconds. The same seed
    and the same moves give the same frames.

    Parameters
    ----------
    profile : SensorBuild, str or Path
        A profile, its name, or the path of its YAML file. A name or a path applies the profile's
        ``sim`` overlay.
    seed : int
        Random seed of the unit (grain, positions of faults) and of the noise.
    mode : "accurate" or "fast"
        "accurate" puts at least ten nodes on the radius of a contact; "fast" runs at camera rate.
    overrides : mapping, optional
        Profile keys to replace, e.g. ``{"gel": {"friction": 0.3}}``. Only with a name or a path.
    faults : Faults, optional
        Defects of the rig.

    Attributes
    ----------
    profile : Profile

    Raises
    ------
    ProfileError, PluginError
        The profile is invalid, or one of its parts cannot be made.
    InputError
        A fault names an unknown light, or the seed is negative.
    """

    def __init__(
        self,
        profile: SensorBuild | str | Path,
        seed: int = 0,
        mode: Mode = "fast",
        overrides: Mapping[str, Any] | None = None,
        faults: Faults | None = None,
    ) -> None:
        if isinstance(profile, str | Path):
            profile = load_profile(profile, sim=True, overrides=overrides)
        elif overrides:
            raise TypeError("overrides need a profile's name or path, not a Profile")
        if seed < 0:
            raise InputError(f"seed should be 0 or more, not {seed}")
        super().__init__(profile, mode)
        self.profile = profile
        self._optics = RigOptics(profile, seed=seed, faults=faults, mode=mode)
        self.markers_px = self._optics.markers_px

    def reset(self) -> None:
        """Remove the object and return to the undeformed gel surface."""
        super().reset()
        self._shot = 0

    def indenter(
        self,
        kind: str,
        *,
        x_mm: float = 0.0,
        y_mm: float = 0.0,
        angle_deg: float = 0.0,
        **options: Any,
    ) -> None:
        """Select the object for the next press, and place it above the gel surface.

        Parameters
        ----------
        kind : str
            "sphere", "cylinder", "flat", "cone", "heightmap", "mesh", "coin", "screw", "letters" or
            "cloth"; :data:`tactile_sim.indenters.KINDS`.
        x_mm, y_mm : float
            Position of the object's origin relative to the image centre.
        angle_deg : float
            Rotation of the object, positive from x towards y.
        **options
            Options of the kind, e.g. ``diameter_mm=8``, and ``texture``;
            :func:`tactile_sim.indenters.make_indenter`.

        Raises
        ------
        InputError
            Unknown kind or option, an invalid size, or an object is still pressed.
        """
        made = make_indenter(kind, **options)
        self.indent_with(made, x_mm=x_mm, y_mm=y_mm, angle_deg=angle_deg)

    def frame(self) -> Frame:
        """Take a frame with every exposure of the rig's sequence."""
        taken = self._optics.take_frame(*self._shown(), number=self._shot, time_s=self.time_s)
        self._shot += 1
        return taken

    def exposures(self) -> list[Pixels]:
        """Take a frame, as a list of the sequence's exposures including dark ones.

        Returns
        -------
        list of (H, W, 1) or (H, W, 3) uint8 or uint16
        """
        number, shown = self._shot, self._shown()
        lit = iter(self._optics.take_images(*shown, frame=number))
        self._shot += 1
        dark = self._optics.surface(shown[0]) if self._has_dark else None
        return [
            next(lit)
            if exposure.channels or dark is None
            else self._optics.photograph(dark, {}, frame=number)
            for exposure in self._optics.exposures
        ]

    def _shown(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any] | None]:
        """Height, displacement and markers, as the optics take them."""
        truth = self.truth()
        markers_px = truth.markers_px if len(truth.markers_px) else None
        return truth.height_mm, truth.displacement_mm, markers_px

    @property
    def _shots(self) -> int:
        return sum(bool(exposure.channels) for exposure in self._optics.exposures)

    @property
    def _has_dark(self) -> bool:
        return self._shots < len(self._optics.exposures)


_Model = TypeVar("_Model", bound=BaseModel)


def vary(profile: Profile, seed: int) -> Profile:
    """Return another unit of the same design.

    The units of different seeds differ in light, coating, gel, print and camera; their names and
    images' sizes are the design's. The same seed gives the same unit.

    Parameters
    ----------
    profile : Profile
        The design, for example ``load_profile("hex_fingertip", sim=True)``.
    seed : int
        0 or more.

    Returns
    -------
    Profile
        For :class:`~tactile_sim.VirtualStage`.
    """
    draw = _Draw(np.random.default_rng([seed, 51]))
    return profile.model_copy(
        update={
            "illumination": _lighting(profile.illumination, draw),
            "optics": _optics(profile, draw),
            "gel": _gel(profile.gel, draw),
        }
    )


class _Draw:
    """Random deviations, uniform up to ``most``; ``factor`` is about 1 and ``offset`` about 0."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def offset(self, most: float) -> float:
        return float(self._rng.uniform(-most, most))

    def factor(self, most: float) -> float:
        return 1 + self.offset(most)

    def share(self, value: float, most: float, limit: float = 1.0) -> float:
        return min(value * self.factor(most), limit)


def _lighting(lighting: Lighting, draw: _Draw) -> Lighting:
    lights = lighting.options.get("lights")
    if not lights:
        return lighting
    # degrees: an LED board is 1 mm out of place at 12 mm from the gel
    moved = [
        light
        | {
            "azimuth_deg": light["azimuth_deg"] + draw.offset(5.0),
            "elevation_deg": float(np.clip(light["elevation_deg"] + draw.offset(4.0), 1, 90)),
        }
        for light in lights
    ]
    return lighting.model_copy(update={"lights": moved})


def _optics(profile: Profile, draw: _Draw) -> Optics:
    optics = profile.optics
    coat, sensor, lights = optics.coat, optics.sensor, optics.lights
    coating = Coating.from_profile(profile)
    new: dict[str, Any] = {
        "lights": {
            "spread": float(np.hypot(lights.spread, 0.15)),  # bins of LEDs are 20 to 30 % wide
            "distance_mm": lights.distance_mm and lights.distance_mm * draw.factor(0.08),
        },
        "ambient": draw.share(optics.ambient, 0.5),
        "coat": {  # coatings made by hand vary by half
            "specular": float(np.clip(coating.specular + draw.offset(0.1), 0, 1)),
            "roughness": coating.roughness * draw.factor(0.2),
            "grain": coat.grain * draw.factor(0.5),
            "ink": reflectance_of_ink(profile) * draw.factor(0.5),
        },
        "sensor": {
            "exposure": draw.share(sensor.exposure, 0.15, 0.95),
            "white_balance": tuple(gain * draw.factor(0.1) for gain in sensor.white_balance),
            "full_well_e": sensor.full_well_e * draw.factor(0.3),
            "read_noise_e": sensor.read_noise_e * draw.factor(0.3),
            "vignetting": draw.share(sensor.vignetting, 0.5),
            "crosstalk": draw.share(sensor.crosstalk, 0.3, 0.5),
        },
    }
    markers = profile.gel.markers
    if isinstance(markers, Markers):  # gels are mounted by hand
        jitter_mm = 0.05 * markers.diameter_mm
        new["markers"] = {
            "shift_mm": tuple(mm + draw.offset(0.5) for mm in optics.markers.shift_mm),
            "angle_deg": optics.markers.angle_deg + draw.offset(2.0),
            "jitter_mm": float(np.hypot(optics.markers.jitter_mm, jitter_mm)),
        }
    return _replace_values(optics, new)


def _gel(gel: Gel, draw: _Draw) -> Gel:
    new: dict[str, Any] = {}
    if gel.thickness_mm is not None:
        new["thickness_mm"] = gel.thickness_mm * draw.factor(0.05)  # 0.1 mm in 2 mm, as cast
    if gel.shear_modulus_mpa is not None:
        new["shear_modulus_mpa"] = gel.shear_modulus_mpa * draw.factor(0.2)  # 5 points of Shore
    slippery = draw.factor(0.2)  # dust and wear
    new["friction"] = slippery * (FRICTION if gel.friction is None else gel.friction)
    if gel.kinetic_friction is not None:
        new["kinetic_friction"] = slippery * gel.kinetic_friction
    if isinstance(gel.markers, Markers):
        size_mm = gel.markers.diameter_mm * draw.factor(0.1)
        new["markers"] = {"diameter_mm": min(size_mm, 0.9 * gel.markers.pitch_mm)}
    return _replace_values(gel, new)


def _replace_values(model: _Model, new: dict[str, Any]) -> _Model:
    """Return a validated copy with new values, in nested sections too."""
    values = model.model_dump()
    for name, value in new.items():
        inside = values.get(name)
        values[name] = inside | value if isinstance(inside, dict) else value
    return type(model).model_validate(values)


class UnitOptions(Options):
    """Which virtual unit is shown, and how finely it is simulated."""

    seed: int = Field(
        default=0, ge=0, description="Random seed of the virtual unit and of its noise."
    )
    mode: Mode = Field(
        default="fast",
        description="fast runs at camera rate; accurate solves the contact on a finer grid.",
    )
