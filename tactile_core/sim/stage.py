"""A virtual rig under an object that moves: what its camera sees, and what is true."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Pixels
from tactile_core.sim import kernels
from tactile_core.sim.indenters import make_indenter
from tactile_core.sim.optics.faults import Faults
from tactile_core.sim.optics.rig import RigOptics
from tactile_core.sim.skin import Mode, Skin
from tactile_core.sim.truth import Truth


class VirtualStage:
    """Moves an object on the virtual twin of a profile.

    Increments are quasi-static, as slow as it takes for all stress to relax, unless they are given
    seconds. The same seed and the same moves give the same frames.

    Parameters
    ----------
    profile : SensorBuild, str or Path
        A profile, its name, or the path of its YAML file; its ``sim`` overlay is laid over it.
    seed : int
        Makes the unit (grain, places of faults) and the noise.
    mode : "accurate" or "fast"
        Accurate puts ten nodes or more on a contact's radius; fast keeps up with a camera.
    overrides : mapping, optional
        Laid over the profile: ``{"gel": {"friction": 0.3}}``. Only with a name or a path.
    faults : Faults, optional
        Of the rig.

    Attributes
    ----------
    profile : Profile

    Raises
    ------
    ProfileError, PluginError
        The profile or one of its parts is unusable.
    InputError
        The gel has no thickness or modulus, a fault names a light that there is not, or the seed is
        negative.
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
            raise TypeError("overrides are laid over a profile's name or path, not a Profile")
        if seed < 0:
            raise InputError(f"seed should be 0 or more, not {seed}")
        self.profile = profile
        self._skin = Skin(profile, mode)
        self._optics = RigOptics(profile, seed=seed, faults=faults, mode=mode)
        self._shot = 0

    def reset(self) -> None:
        """Take the object away and forget everything that was done to the skin."""
        self._skin.reset()
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
        """Choose the object that is pressed next, and hold it above the skin.

        Parameters
        ----------
        kind : str
            "sphere", "cylinder", "flat", "cone", "heightmap", "mesh", "coin", "screw", "letters" or
            "cloth"; :data:`tactile_core.sim.indenters.KINDS`.
        x_mm, y_mm : float
            Where its origin comes, from the image centre.
        angle_deg : float
            Its turn, from x towards y.
        **options
            Of that kind: ``diameter_mm=8``.

        Raises
        ------
        InputError
            No such kind or option, a size makes no sense, or an object is still pressed.
        """
        made = make_indenter(kind, **options)
        self._skin.indent_with(made, x_mm=x_mm, y_mm=y_mm, angle_deg=angle_deg)

    def press(
        self,
        depth_mm: float | None = None,
        force_n: float | None = None,
        *,
        steps: int | None = None,
        seconds: float | None = None,
    ) -> None:
        """Lower or raise the object to a depth or a force; see :meth:`Skin.press`."""
        self._skin.press(depth_mm, force_n, steps=steps, seconds=seconds)

    def shear(
        self,
        dx_mm: float = 0.0,
        dy_mm: float = 0.0,
        steps: int = 1,
        *,
        seconds: float | None = None,
    ) -> None:
        """Move the object along the skin, by so much; see :meth:`Skin.shear`."""
        self._skin.shear(dx_mm, dy_mm, steps, seconds=seconds)

    def twist(self, degrees: float, steps: int = 1, *, seconds: float | None = None) -> None:
        """Turn the object from x towards y, by so much; see :meth:`Skin.twist`."""
        self._skin.twist(degrees, steps, seconds=seconds)

    def roll(
        self,
        dx_mm: float = 0.0,
        dy_mm: float = 0.0,
        steps: int = 1,
        *,
        seconds: float | None = None,
    ) -> None:
        """Roll the object, by so much; see :meth:`Skin.roll`."""
        self._skin.roll(dx_mm, dy_mm, steps, seconds=seconds)

    def hold(self, seconds: float) -> None:
        """Let time pass."""
        self._skin.hold(seconds)

    def release(self, seconds: float | None = None) -> None:
        """Take the object away, and let the skin recover for some seconds; by default, fully."""
        self._skin.release(seconds)

    def check_depth(self, depth_mm: float) -> None:
        """Refuse a depth that reaches the plate behind the gel, by an InputError."""
        self._skin.gel.check_depth(depth_mm)

    @property
    def depth_mm(self) -> float:
        """How far beyond the first touch the object is lowered; 0 where none is pressed."""
        return float(self._skin.state.depth_mm) if self._skin.pressed else 0.0

    @property
    def force_n(self) -> float:
        """Normal force on the skin."""
        return float(self._skin.wrench[2])

    @property
    def time_s(self) -> float:
        """Simulated time; it passes only where a move is given seconds."""
        return self._skin.time_s

    def frame(self) -> Frame:
        """Take a frame, every exposure of the rig's sequence."""
        height_mm, displacement_mm = self._skin.seen(kernels.load_for(self._shot))
        rest_px = self._optics.markers_px
        pixels = self._optics.expose(
            height_mm,
            displacement_mm,
            self._skin.carried_px(rest_px) if len(rest_px) else None,
            frame=self._shot,
        )
        channels = self._optics.channels
        in_turn = self._shots > 1
        taken = Frame(
            pixels=pixels,
            channels=channels,
            mm_per_px=self.profile.image.mm_per_px,
            full_scale=self._optics.full_scale,
            timestamp_s=self._skin.time_s,
            sequence=self._shot,
            source=f"{self._shot:06d}",
            exposure_times_s=(self._skin.time_s,) * (len(channels) if in_turn else 1),
        )
        self._shot += 1
        return taken

    def exposures(self) -> list[Pixels]:
        """Take a frame; every exposure of the rig's sequence by itself, dark ones too.

        Returns
        -------
        list of (H, W, 1) or (H, W, 3) uint8 or uint16
        """
        number = self._shot
        lit = iter(np.split(self.frame().pixels, self._shots, axis=2))
        dark = self._optics.skin(self._skin.truth().height_mm) if self._has_dark else None
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

    def truth(self) -> Truth:
        """Return all that is true of the skin now, at the pixels of the image.

        ``markers_px`` are where the printed marks are now; some lie beyond the image.
        """
        return self._skin.truth(self._optics.markers_px)
