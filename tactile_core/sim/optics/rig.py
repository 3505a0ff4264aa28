"""The optics of one rig: from the state of the skin to the frame that the camera sends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.illumination import Exposure
from tactile_core.profiles.model import Profile
from tactile_core.sim.optics.camera import Chip, Noise, crosstalk_matrix, vignette
from tactile_core.sim.optics.coating import Coating, Shading
from tactile_core.sim.optics.faults import Faults
from tactile_core.sim.optics.lights import illumination_of, lamps_of, light_field
from tactile_core.sim.optics.shadows import Shadows
from tactile_core.sim.optics.skin import Membrane, Skin

Float32 = NDArray[np.float32]
Mode = Literal["fast", "accurate"]

_SHADOW_COLUMNS = {"fast": 96, "accurate": 640}
_BAND_PX = 32
_VIEW_DIAGONALS = 1.5
_COLOURS = 3


@dataclass(frozen=True, eq=False)
class _Source:
    """One lamp, ready to light any state of the skin."""

    name: str
    feeds: tuple[str, ...]
    shading: Shading
    shadows: Shadows
    ambient: float


class RigOptics:
    """What a profile's camera sees of a skin whose height and displacement are known.

    Everything comes from the profile: the lamps and the sequence of exposures from its
    illumination, the coating and the print from its gel, the rest from its ``optics``. Images are
    those in which everything is measured, ``image.width_px × image.height_px``; crop, warp and lens
    are not undone.

    Parameters
    ----------
    profile : Profile
    seed : int
        Makes the unit (grain, places of faults) and its noise; the same seed gives the same frames.
    faults : Faults, optional
    mode : {"fast", "accurate"}
        Fast keeps up with a camera: shadows on a coarser grid, and noise from a table.

    Attributes
    ----------
    channels : tuple of str
        Names of the K channels of a frame.
    exposures : tuple of Exposure
        The sequence that makes one frame.
    full_scale : float
        The largest intensity.

    Raises
    ------
    PluginError
        The illumination's plugin is absent.
    InputError
        A fault names a light that there is not; JPEG is asked for at more than 8 bits.
    """

    def __init__(
        self,
        profile: Profile,
        *,
        seed: int = 0,
        faults: Faults | None = None,
        mode: Mode = "fast",
    ) -> None:
        if mode not in _SHADOW_COLUMNS:
            raise InputError(f"mode is 'fast' or 'accurate', not {mode!r}")
        image, said = profile.image, profile.optics
        self.profile = profile
        self.full_scale = image.full_scale
        self._seed = seed
        self._faults = faults or Faults()
        self._shape = (image.height_px, image.width_px)
        illumination = illumination_of(profile)
        self.exposures: tuple[Exposure, ...] = illumination.exposures()
        self.channels = illumination.channels
        self._shots = tuple(e for e in self.exposures if e.channels)
        lamps = lamps_of(profile, self.exposures, illumination.options)
        self._faults.check_lights(tuple(lamp.name for lamp in lamps))
        self._membrane = Membrane(profile, len(lamps), self._faults, seed)
        coating = Coating.of(profile)
        view = self._view(said.sensor.view_distance_mm)
        strengths = np.random.default_rng([seed, 41]).standard_normal(len(lamps))
        sources = []
        for lamp, strength in zip(lamps, strengths, strict=True):
            whole = light_field(
                lamp, self._shape, mm_per_px=image.mm_per_px, rest_mm=self._membrane.rest_mm
            )
            toward = whole
            if dead := self._faults.dead_leds.get(lamp.name):
                toward = light_field(
                    lamp,
                    self._shape,
                    mm_per_px=image.mm_per_px,
                    rest_mm=self._membrane.rest_mm,
                    dead_leds=tuple(dead),
                )
            level = float(np.median(whole[2])) * max(0.1, 1 + lamp.build.spread * strength)
            bright = np.float32((1 - said.ambient) * level / np.median(whole[2]))
            sources.append(
                _Source(
                    lamp.name,
                    lamp.feeds,
                    Shading.prepare(toward * bright, lamp.blur * float(bright), coating, view),
                    Shadows.prepare(
                        toward,
                        lamp.blur,
                        mm_per_px=image.mm_per_px,
                        reduce=max(1, image.width_px // _SHADOW_COLUMNS[mode]),
                    ),
                    said.ambient * level,
                )
            )
        self._sources = tuple(sources)
        self._chip = Chip.of(profile)
        self._noise = Noise(
            int(np.prod(self._shape)) * max(len(e.channels) for e in self._shots),
            seed,
            from_table=mode == "fast",
        )
        self._glass = vignette(self._shape, said.sensor.vignetting)
        colours = len(self._shots[0].channels)
        self._mixing = self._balanced(
            said.sensor.exposure,
            crosstalk_matrix(said.sensor.crosstalk) if colours == _COLOURS else np.eye(colours),
        )
        dust = self._faults.dusty(self._shape, seed)
        if dust is not None:
            self._glass = self._glass * dust
        self._frame = 0
        self._last: NDArray[Any] | None = None

    @property
    def markers_px(self) -> NDArray[np.float64]:
        """(N, 2) centres of the printed marks on the resting skin, x and y; also beyond the image."""
        marks = self._membrane.marks
        return np.zeros((0, 2)) if marks is None else marks.rest_px.copy()

    def expose(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        markers_px: NDArray[Any] | None = None,
        *,
        frame: int | None = None,
    ) -> NDArray[Any]:
        """Take one frame: every exposure of the sequence.

        Parameters
        ----------
        height_mm : (H, W) float
            Of the skin above its rest surface, positive where it is pressed towards the camera.
        displacement_mm : (H, W, 2) float, optional
            How far the skin that is now at a pixel has moved, x right and y down. Carries print,
            grain and scratches.
        markers_px : (N, 2) float, optional
            Where the marks of :attr:`markers_px` are now, in place of where the displacement
            carries them; NaN where one is out of sight.
        frame : int, optional
            Number of the frame, for its noise and its faults; the next one if left out.

        Returns
        -------
        (H, W, K) uint8 or uint16

        Raises
        ------
        InputError
            An array has another size than the image, or is not finite.
        """
        number = self._frame if frame is None else frame
        self._frame = number + 1
        fate, above = self._faults.fate(number, self._seed)
        if fate == "dropped" and self._last is not None:
            return self._last
        skin = self.skin(height_mm, displacement_mm, markers_px)
        late = len(self._shots) > 1 and self._faults.slips(number, self._seed)
        planes = [
            self.photograph(
                skin, self._shots[shot - 1 if late else shot].levels, frame=number, exposure=shot
            )
            for shot in range(len(self._shots))
        ]
        pixels = planes[0] if len(planes) == 1 else np.concatenate(planes, axis=2)
        if fate == "torn" and self._last is not None:
            row = int(above * len(pixels))
            pixels = np.concatenate([pixels[:row], self._last[row:]])
        self._last = pixels
        return pixels

    def skin(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        markers_px: NDArray[Any] | None = None,
    ) -> Skin:
        """Prepare a state of the skin for :meth:`photograph`; parameters as for :meth:`expose`."""
        height = self._checked(height_mm, self._shape, "height_mm")
        displacement = None
        if displacement_mm is not None:
            displacement = self._checked(displacement_mm, (*self._shape, 2), "displacement_mm")
        if markers_px is not None and np.shape(markers_px) != self.markers_px.shape:
            raise InputError(
                f"markers_px has the shape {np.shape(markers_px)} where the print has "
                f"{self.markers_px.shape}; give one place per mark, NaN for those out of sight"
            )
        return self._membrane.state(height, displacement, markers_px)

    def photograph(
        self, skin: Skin, levels: Mapping[str, float], *, frame: int = 0, exposure: int = 0
    ) -> NDArray[Any]:
        """Take one exposure under some lights.

        Parameters
        ----------
        skin : Skin
        levels : mapping of light to brightness
            0..1; lights that are not named are dark.
        frame, exposure : int
            Numbers that choose the noise.

        Returns
        -------
        (H, W, 1) or (H, W, 3) uint8 or uint16
        """
        pixels = np.empty((*self._shape, len(self._mixing)), self._chip.dtype)
        noise = self._noise.of(frame, exposure)[: pixels.size].reshape(pixels.shape)
        mixing = self._mixing * self._faults.overexposure
        for rows, light in self._light(skin, self._shining(levels, frame), mixing):
            pixels[rows] = self._chip.read_out(light, noise[rows])
        return self._chip.send(pixels)

    def _shining(self, levels: Mapping[str, float], frame: int) -> list[tuple[int, float]]:
        """Lamps that shine, by number, and how brightly."""
        bright = [
            levels.get(source.name, 0.0) * self._faults.level(source.name, k, frame, self._seed)
            for k, source in enumerate(self._sources)
        ]
        return [(k, level) for k, level in enumerate(bright) if level > 0]

    def _light(
        self, skin: Skin, shining: list[tuple[int, float]], mixing: NDArray[Any]
    ) -> Iterator[tuple[slice, Float32]]:
        """(h, W, K) light that falls on bands of the chip, after a (K, K) mixing of the colours."""
        names = self._shots[0].channels
        low = self._sources[0].shadows.reduced(skin.relief_mm)
        seen = {
            k: None if low is None else self._sources[k].shadows.cast(low, self._shape)
            for k, _ in shining
        }
        mixing = mixing.astype(np.float32)
        # Bands of rows stay in the processor's cache.
        for top in range(0, self._shape[0], _BAND_PX):
            rows = slice(top, top + _BAND_PX)
            normals = skin.normals[:, rows]
            sky = 0.5 * normals[2] + 0.5
            lit = np.zeros((len(names), *sky.shape), np.float32)
            ambient = np.zeros(len(names), np.float32)
            for k, level in shining:
                source, shade = self._sources[k], seen[k]
                light = source.shading.reflect(normals, rows)
                if shade is not None:
                    light *= shade[rows]
                light *= skin.grain[k][rows]
                if level != 1:
                    light *= np.float32(level)
                fed = [c for c, name in enumerate(names) if name in source.feeds]
                for c in fed or range(len(names)):
                    lit[c] += light
                    ambient[c] += level * source.ambient
            for plane, share in zip(lit, ambient, strict=True):
                plane += sky * share
            veil = self._glass[rows]
            lit *= veil if skin.reflectance is None else veil * skin.reflectance[rows]
            if len(names) == 1:
                yield rows, (lit[0] * mixing[0, 0])[..., None]
            else:
                yield rows, np.asarray(cv2.transform(cv2.merge([*lit]), mixing), np.float32)

    def _balanced(self, exposure: float, crosstalk: NDArray[Any]) -> NDArray[np.float64]:
        """(K, K) mixing of the colours that brings the resting skin to the wanted intensity.

        Colours are balanced to white, as webcams do; lamps in turn share one gain.
        """
        rest = self._membrane.state(np.zeros(self._shape, np.float32))
        bare = replace(rest, reflectance=None)
        frames = []
        for shot in self._shots:
            # Without the faults, lest a dead lamp be made up for.
            named = [shot.levels.get(source.name, 0.0) for source in self._sources]
            shining = [(k, level) for k, level in enumerate(named) if level > 0]
            frames.append(np.concatenate([b for _, b in self._light(bare, shining, crosstalk)]))
        level = np.mean([np.median(light, axis=(0, 1)) for light in frames], axis=0)
        level[level <= 0] = max(level.max(), 1e-6)
        return np.asarray(self._chip.light_of(exposure) / level[:, None] * crosstalk)

    def _view(self, distance_mm: float | None) -> Float32:
        """(3, H, W) unit vectors from the skin to the pupil above the image centre."""
        y, x = ((np.arange(n) - (n - 1) / 2) * self.profile.image.mm_per_px for n in self._shape)
        high = distance_mm or _VIEW_DIAGONALS * 2 * float(np.hypot(x[-1], y[-1]))
        view = np.stack(np.broadcast_arrays(-x, -y[:, None], high)).astype(np.float32)
        return np.asarray(view / np.sqrt((view**2).sum(0)), np.float32)

    def _checked(self, values: NDArray[Any], shape: tuple[int, ...], name: str) -> Float32:
        array = np.asarray(values, np.float32)
        if array.shape != shape:
            raise InputError(f"{name} has the shape {array.shape}; this rig's is {shape}")
        if not np.isfinite(array.sum()):
            raise InputError(f"{name} has values that are not finite; give 0 where nothing is")
        return array
