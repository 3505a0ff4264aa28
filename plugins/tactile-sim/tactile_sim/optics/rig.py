"""Optics of one rig: from the state of the gel surface to camera frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.acquisition.devices import exposures_of, make_lights
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import COLORS, COLOUR, Exposure
from tactile_core.interfaces.simulator import Renderer
from tactile_core.quantities import Frame
from tactile_sim.modes import Mode
from tactile_sim.optics.camera import Chip, Noise, crosstalk_matrix, vignette
from tactile_sim.optics.faults import Faults
from tactile_sim.optics.lights import led_arrays_of
from tactile_sim.optics.sources import LightSource, Shining, sources_of
from tactile_sim.optics.surface import Membrane, OpticalSurface

# [px] Approximate width of the grid of shadows: at camera rate (``benchmarks/bench_sim.py``), and
# every pixel of 640 × 480
_SHADOW_COLUMNS = {"fast": 96, "accurate": 640}


class RigOptics(Renderer):
    """Renders what a profile's camera sees of a gel surface of given height and displacement.

    The profile determines everything: its illumination the lights and the sequence of exposures,
    its gel the coating and the markers, its ``optics`` the rest. Images have the size
    ``image.width_px × image.height_px``, after crop, warp and lens correction.

    Parameters
    ----------
    profile : SensorBuild
    seed : int
        Random seed of the unit (grain, positions of faults) and of its noise; the same seed gives
        the same frames.
    faults : Faults, optional
    mode : {"fast", "accurate"}
        "fast" runs at camera rate: it computes shadows on a coarser grid and reads noise from a
        table.

    Attributes
    ----------
    channels : tuple of str
        Names of the K channels of a frame.
    exposures : tuple of Exposure
        Sequence of exposures of one frame.
    full_scale : float
        Largest pixel value.

    Raises
    ------
    PluginError
        The illumination's plugin is not installed.
    InputError
        A fault names an unknown light, or JPEG is combined with more than 8 bits.
    """

    def __init__(
        self,
        profile: SensorBuild,
        *,
        seed: int = 0,
        faults: Faults | None = None,
        mode: Mode = "fast",
    ) -> None:
        self.profile = profile
        self.full_scale = profile.image.full_scale
        self._seed = seed
        self._faults = faults or Faults()
        self._shape = (profile.image.height_px, profile.image.width_px)
        illumination = make_lights(profile)
        self.channels = illumination.channels
        self.exposures: tuple[Exposure, ...] = exposures_of(illumination)
        self._shots = tuple(e for e in self.exposures if e.channels)
        # One camera takes every exposure: all have the same number of colours.
        coloured = any(shot.color for shot in self._shots)
        self._colours: tuple[str, ...] = COLORS if coloured else self._shots[0].channels
        led_arrays = led_arrays_of(profile, illumination)
        self._faults.check_lights([led_array.name for led_array in led_arrays])
        self._membrane = Membrane(profile, len(led_arrays), self._faults, seed)
        self._sources = sources_of(
            profile,
            led_arrays,
            rest_mm=self._membrane.rest_mm,
            seed=seed,
            shadow_columns=_SHADOW_COLUMNS[mode],
        )
        self._chip = Chip.from_profile(profile)
        size = self._shape[0] * self._shape[1] * len(self._colours)
        self._noise = Noise(size, seed, from_table=mode == "fast")
        self._mixing = self._balance_mixing()
        self._glass = vignette(self._shape, profile.optics.sensor.vignetting)
        self._glass *= self._faults.dusty(self._shape, seed)
        self._frame = 0

    @property
    def markers_px(self) -> NDArray[np.float64]:
        """(N, 2) marker centres on the undeformed surface, x and y; some are outside the image."""
        markers = self._membrane.markers
        return np.zeros((0, 2)) if markers is None else markers.rest_px.copy()

    def expose(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        markers_px: NDArray[Any] | None = None,
        *,
        frame: int | None = None,
    ) -> NDArray[Any]:
        """Take one frame with every exposure of the sequence.

        Parameters
        ----------
        height_mm : (H, W) float
            Indentation relative to the undeformed surface, positive towards the camera.
        displacement_mm : (H, W, 2) float, optional
            In-plane displacement of the material that is now at each pixel, x right and y down. It
            moves markers and grain.
        markers_px : (N, 2) float, optional
            Current positions of the markers of :attr:`markers_px`, instead of those that follow
            from the displacement; NaN for hidden markers.
        frame : int, optional
            Frame number, which selects noise and faults. Default: the next one.

        Returns
        -------
        (H, W, K) uint8 or uint16

        Raises
        ------
        InputError
            An array does not have the image's size, or is not finite.
        """
        images = self.take_images(height_mm, displacement_mm, markers_px, frame=frame)
        return self.channels_of(images)

    def take_images(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        markers_px: NDArray[Any] | None = None,
        *,
        frame: int | None = None,
    ) -> list[NDArray[Any]]:
        """Take the images of one frame, as the camera sends them; parameters as for `expose`.

        Returns
        -------
        list of (H, W, 1) or (H, W, 3) uint8 or uint16
            One per exposure that is not dark.
        """
        number = self._frame if frame is None else frame
        self._frame = number + 1
        surface = self.surface(height_mm, displacement_mm, markers_px)
        levels = [shot.levels for shot in self._shots]
        return self._take_exposures(surface, levels, number, first=0)

    def channels_of(self, images: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Return the (H, W, K) channels of the images of one frame."""
        planes = [
            image if shot.color is None else image[..., [COLORS.index(shot.color)]]
            for image, shot in zip(images, self._shots, strict=True)
        ]
        return planes[0] if len(planes) == 1 else _side_by_side(planes)

    def take_frame(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        markers_px: NDArray[Any] | None = None,
        *,
        number: int,
        time_s: float = 0.0,
    ) -> Frame:
        """Take one frame as :meth:`expose` does, with its number and simulated time."""
        pixels = self.expose(height_mm, displacement_mm, markers_px, frame=number)
        return Frame(
            pixels=pixels,
            channels=self.channels,
            mm_per_px=self.profile.image.mm_per_px,
            full_scale=self.full_scale,
            timestamp_s=time_s,
            sequence=number,
            source=f"{number:06d}",
            exposure_times_s=(time_s,) * len(self._shots),
        )

    def surface(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        markers_px: NDArray[Any] | None = None,
    ) -> OpticalSurface:
        """Prepare a gel surface for :meth:`photograph`; parameters as for :meth:`expose`."""
        height = self._check_values(height_mm, self._shape, "height_mm")
        displacement = None
        if displacement_mm is not None:
            moved = (*self._shape, 2)
            displacement = self._check_values(displacement_mm, moved, "displacement_mm")
        if markers_px is not None and np.shape(markers_px) != self.markers_px.shape:
            raise InputError(
                f"markers_px has the shape {np.shape(markers_px)}, not {self.markers_px.shape}; "
                f"give one position per printed marker, NaN for hidden ones"
            )
        return self._membrane.state(height, displacement, markers_px)

    def photograph(
        self,
        surface: OpticalSurface,
        levels: Mapping[str, float],
        *,
        frame: int = 0,
        exposure: int = 0,
    ) -> NDArray[Any]:
        """Take one exposure under some lights.

        Parameters
        ----------
        surface : OpticalSurface
        levels : mapping of light to brightness
            0..1; other lights are off.
        frame, exposure : int
            Frame and exposure number, which select the noise.

        Returns
        -------
        (H, W, 1) or (H, W, 3) uint8 or uint16
        """
        return self._take_exposures(surface, [levels], frame, first=exposure)[0]

    def _take_exposures(
        self,
        surface: OpticalSurface,
        levels: Sequence[Mapping[str, float]],
        frame: int,
        *,
        first: int,
    ) -> list[NDArray[Any]]:
        """Take exposures under some lights each, as (H, W, K); ``first`` is the first's number."""
        mixing = self._mixing.astype(np.float32)
        sources = tuple(
            (number, source, bright, exposure)
            for exposure, lit in enumerate(levels)
            for number, source in enumerate(self._sources)
            if (bright := self._brightness(source, number, lit, frame)) > 0
        )
        shining = Shining(sources, surface, self._colours, len(levels))
        noise = [
            self._noise.draw_samples(frame, first + exposure) for exposure in range(len(levels))
        ]
        colours = len(self._colours)
        taken = np.empty((len(levels), *self._shape, colours), self._chip.dtype)
        numbers = [one.steps.reshape(-1, *self._shape) for one in noise]
        for rows, light in shining.bands(self._glass):
            for exposure, pixels in enumerate(taken):
                own = light[colours * exposure : colours * (exposure + 1)]
                mixed = (mixing @ own.reshape(colours, -1)).reshape(own.shape)
                coded = self._chip.read_out(
                    mixed, numbers[exposure][:, rows], noise[exposure].scale
                )
                cv2.merge([*coded], dst=pixels[rows])
        return [self._chip.send(pixels) for pixels in taken]

    def _brightness(
        self, source: LightSource, number: int, levels: Mapping[str, float], frame: int
    ) -> float:
        name = source.led_array.name
        return levels.get(name, 0.0) * self._faults.level(name, number, frame, self._seed)

    def _balance_mixing(self) -> NDArray[np.float64]:
        """(K, K) mixing matrix that gives the undeformed surface the profile's exposure.

        Colours are balanced to white, as by webcams, each in the exposures that it measures;
        sequential lights of one colour share one gain. Faults are ignored, so that the gain does
        not compensate a dead light.
        """
        sensor = self.profile.optics.sensor
        count = len(self._colours)
        mixing = crosstalk_matrix(sensor.crosstalk) if count == COLOUR else np.eye(count)
        bare = replace(self._membrane.state(np.zeros(self._shape, np.float32)), reflectance=None)
        medians, counted = [], []
        for shot in self._shots:
            sources = tuple(
                (number, source, level, 0)
                for number, source in enumerate(self._sources)
                if (level := shot.levels.get(source.led_array.name, 0.0)) > 0
            )
            shining = Shining(sources, bare, self._colours)
            light = np.concatenate([band for _, band in shining.bands()], axis=1)
            medians.append(mixing @ np.median(light, axis=(1, 2)))
            counted.append([shot.color in (None, name) for name in self._colours])
        level = np.sum(np.multiply(medians, counted), axis=0) / np.maximum(
            np.sum(counted, axis=0), 1
        )
        level[level <= 0] = max(level.max(), 1e-6)
        gain = np.array(sensor.white_balance if count == COLOUR else (1.0,) * count)
        gain = gain * self._chip.light_of(sensor.exposure) / level
        return np.asarray(gain[:, None] * mixing)

    def _check_values(self, values: NDArray[Any], shape: tuple[int, ...], name: str) -> Float32:
        array = np.asarray(values, np.float32)
        if array.shape != shape:
            raise InputError(f"{name} has the shape {array.shape}; this rig's is {shape}")
        if not _is_finite(array):
            raise InputError(f"{name} has values that are not finite; use 0 where undeformed")
        return array


def _is_finite(array: Float32) -> bool:
    """Whether no value is infinite or missing: a sum of squares is fast if rows are contiguous."""
    planes = array if array.flags.c_contiguous else np.moveaxis(array, -1, 0)
    return bool(np.isfinite(np.vdot(planes, planes)))


def _side_by_side(planes: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Channels of all exposures in one image; OpenCV interleaves faster than numpy."""
    if planes[0].shape[2] > 1:
        return np.concatenate(planes, axis=2)
    return np.asarray(cv2.merge([plane[..., 0] for plane in planes]))


def render(profile: SensorBuild, height_mm: NDArray[Any], *, seed: int = 0) -> NDArray[Any]:
    """Render the (H, W, K) image that the profile's camera takes of this height.

    The sensor unit is always the same; the seed selects the image noise. To render many images,
    keep a :class:`RigOptics`.
    """
    return RigOptics(profile).expose(height_mm, frame=seed)
