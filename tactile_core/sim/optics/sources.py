"""Lamps over a coating: how much light each of them sends to the camera by way of the skin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.profiles.model import Profile
from tactile_core.sim.optics.coating import Coating, Shading
from tactile_core.sim.optics.faults import Faults
from tactile_core.sim.optics.lights import Lamp, light_field
from tactile_core.sim.optics.shadows import Shadows
from tactile_core.sim.optics.surface import Surface

Float32 = NDArray[np.float32]

_VIEW_DIAGONALS = 1.5
_DIMMEST = 0.1
_BAND_PX = 64
"""Bands of so many rows stay in the processor's cache."""


@dataclass(frozen=True, eq=False)
class Source:
    """One lamp, ready to light any state of the skin.

    Attributes
    ----------
    lamp : Lamp
    shading : Shading
    shadows : Shadows
    ambient : float
        Light of this lamp that comes from everywhere.
    """

    lamp: Lamp
    shading: Shading
    shadows: Shadows
    ambient: float


def sources_of(
    profile: Profile,
    lamps: Sequence[Lamp],
    *,
    rest_mm: Float32 | None,
    faults: Faults,
    seed: int,
    shadow_columns: int,
) -> tuple[Source, ...]:
    """Prepare lamps for a profile's coating.

    Parameters
    ----------
    profile : Profile
    lamps : sequence of Lamp
    rest_mm : (H, W) float32 or None
        Height of the skin at rest, towards the camera; None for a flat gel.
    faults : Faults
        Dead LEDs.
    seed : int
        Makes the lamps' different brightness.
    shadow_columns : int
        About as wide is the grid on which shadows are found.
    """
    image, ambient = profile.image, profile.optics.ambient
    shape = (image.height_px, image.width_px)
    coating = Coating.of(profile)
    view = _towards_camera(profile, shape)
    deviations = np.random.default_rng([seed, 41]).standard_normal(len(lamps))
    made = []
    for lamp, deviation in zip(lamps, deviations, strict=True):
        whole, toward = (
            light_field(lamp, shape, mm_per_px=image.mm_per_px, rest_mm=rest_mm, dead_leds=dead)
            for dead in ((), faults.dead_leds.get(lamp.name, ()))
        )
        bright = max(_DIMMEST, 1 + lamp.build.spread * float(deviation))
        direct = (1 - ambient) * bright
        shading = Shading.prepare(toward * np.float32(direct), lamp.blur * direct, coating, view)
        shadows = Shadows.prepare(
            toward,
            lamp.blur,
            mm_per_px=image.mm_per_px,
            reduce=max(1, image.width_px // shadow_columns),
        )
        everywhere = ambient * bright * float(np.median(whole[2]))
        made.append(Source(lamp, shading, shadows, everywhere))
    return tuple(made)


def shine(
    sources: Sequence[tuple[Source, float, Float32]], skin: Surface, channels: Sequence[str]
) -> Iterator[tuple[slice, Float32]]:
    """Light a state of the skin.

    Parameters
    ----------
    sources : sequence of (Source, level, grain)
        Those that shine, how brightly, and the (H, W) grain of the skin in their light.
    skin : Surface
    channels : sequence of str
        Names of the camera's colours. A lamp that feeds none of them feeds all.

    Yields
    ------
    rows : slice
    light : (K, h, W) float32
        That the skin in these rows sends to the camera, by channel.
    """
    low = sources[0][0].shadows.reduced(skin.relief_mm) if sources else None
    seen = [
        None if low is None else source.shadows.cast(low, skin.relief_mm.shape)
        for source, _, _ in sources
    ]
    fed = [
        [c for c, name in enumerate(channels) if name in source.lamp.feeds] or range(len(channels))
        for source, _, _ in sources
    ]
    for top in range(0, len(skin.relief_mm), _BAND_PX):
        rows = slice(top, top + _BAND_PX)
        normals = skin.normals[:, rows]
        sky = 0.5 * normals[2] + 0.5
        light = np.zeros((len(channels), *sky.shape), np.float32)
        for (source, level, grain), share, into in zip(sources, seen, fed, strict=True):
            plane = source.shading.reflect(normals, rows)
            if share is not None:
                plane *= share[rows]
            plane *= grain[rows]
            if level != 1:
                plane *= np.float32(level)
            for channel in into:
                light[channel] += plane
        for channel in range(len(channels)):
            ambient = sum(
                level * source.ambient
                for (source, level, _), into in zip(sources, fed, strict=True)
                if channel in into
            )
            light[channel] += sky * np.float32(ambient)
        if skin.reflectance is not None:
            light *= skin.reflectance[rows]
        yield rows, light


def _towards_camera(profile: Profile, shape: tuple[int, int]) -> Float32:
    """(3, H, W) unit vectors from the skin to the pupil, above the image centre."""
    y, x = ((np.arange(n) - (n - 1) / 2) * profile.image.mm_per_px for n in shape)
    diagonal_mm = 2 * float(np.hypot(x[-1], y[-1]))
    high_mm = profile.optics.sensor.view_distance_mm or _VIEW_DIAGONALS * diagonal_mm
    view = np.stack(np.broadcast_arrays(-x, -y[:, None], high_mm)).astype(np.float32)
    return np.asarray(view / np.sqrt((view**2).sum(0)), np.float32)
