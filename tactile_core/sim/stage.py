"""Virtual sensor with a moving object: camera frames and ground truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Pixels
from tactile_core.sim.gel_surface import GelSurface
from tactile_core.sim.indenters import make_indenter
from tactile_core.sim.modes import Mode
from tactile_core.sim.optics.faults import Faults
from tactile_core.sim.optics.rig import RigOptics


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
            "cloth"; :data:`tactile_core.sim.indenters.KINDS`.
        x_mm, y_mm : float
            Position of the object's origin relative to the image centre.
        angle_deg : float
            Rotation of the object, positive from x towards y.
        **options
            Options of the kind, e.g. ``diameter_mm=8``, and ``texture``;
            :func:`tactile_core.sim.indenters.make_indenter`.

        Raises
        ------
        InputError
            Unknown kind or option, an invalid size, or an object is still pressed.
        """
        made = make_indenter(kind, **options)
        self.indent_with(made, x_mm=x_mm, y_mm=y_mm, angle_deg=angle_deg)

    def frame(self) -> Frame:
        """Take a frame with every exposure of the rig's sequence."""
        truth = self.truth()
        markers_px = truth.markers_px if len(truth.markers_px) else None
        pixels = self._optics.expose(
            truth.height_mm, truth.displacement_mm, markers_px, frame=self._shot, finite=True
        )
        channels = self._optics.channels
        sequential = self._shots > 1
        taken = Frame(
            pixels=pixels,
            channels=channels,
            mm_per_px=self.profile.image.mm_per_px,
            full_scale=self._optics.full_scale,
            timestamp_s=self.time_s,
            sequence=self._shot,
            source=f"{self._shot:06d}",
            exposure_times_s=(self.time_s,) * (len(channels) if sequential else 1),
        )
        self._shot += 1
        return taken

    def exposures(self) -> list[Pixels]:
        """Take a frame, as a list of the sequence's exposures including dark ones.

        Returns
        -------
        list of (H, W, 1) or (H, W, 3) uint8 or uint16
        """
        number = self._shot
        lit = iter(np.split(self.frame().pixels, self._shots, axis=2))
        dark = self._optics.surface(self.truth().height_mm) if self._has_dark else None
        return [
            next(lit)
            if exposure.channels or dark is None
            else self._optics.photograph(dark, {}, frame=number)
            for exposure in self._optics.exposures
        ]

    @property
    def _shots(self) -> int:
        return sum(bool(exposure.channels) for exposure in self._optics.exposures)

    @property
    def _has_dark(self) -> bool:
        return self._shots < len(self._optics.exposures)
