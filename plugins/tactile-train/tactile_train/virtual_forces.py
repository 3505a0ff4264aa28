"""Images of pressed, sheared and twisted objects with their forces, on virtual units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32, Float64
from tactile_core.errors import InputError
from tactile_core.profiles.model import Profile
from tactile_sim.stage import VirtualStage, vary


class ForceObject(NamedTuple):
    """An object to press: its indenter kind and sizes in mm."""

    kind: str
    sizes: dict[str, float]

    @property
    def name(self) -> str:
        """Kind and diameter, for example ``sphere 25``."""
        return f"{self.kind} {self.sizes['diameter_mm']:g}"


def _objects(
    spheres: Sequence[float], cylinders: Sequence[float], flats: Sequence[float]
) -> tuple[ForceObject, ...]:
    length = {"length_mm": 12.0}
    return (
        *(ForceObject("sphere", {"diameter_mm": d}) for d in spheres),
        *(ForceObject("cylinder", {"diameter_mm": d} | length) for d in cylinders),
        *(ForceObject("flat", {"diameter_mm": d}) for d in flats),
    )


# Six balls, five cylinders and two planes (Yuan, Dong, Adelson, Sensors 2017, section 5.2).
TRAINING_OBJECTS = _objects((12, 18, 32, 44, 60, 87), (10, 16, 30, 45, 70), (8, 14))
# The ball, the cylinder and the plane that no network trains on (section 5.2).
UNSEEN_OBJECTS = _objects((25,), (22,), (11,))


CELL_PX = 8  # Side of a cell of the grid of loads, in pixels of the samples: the network's features


LARGEST_N = 20.0  # Normal force: the range of the review's Figure 15
# [mm] Largest shear of the object after a press, about a quarter of the gel's thickness: it slips
# fully at small forces and sticks at large ones
TRAVEL_MM = 1.2
TWIST_DEG = 12.0  # Largest twist after two of three presses: the rim of a contact slips
_MOVES = 5  # [count] Increments of shear and twist after each press; each gives one frame


class ForceSample(NamedTuple):
    """One frame of a sequence.

    Attributes
    ----------
    pixels : (height, width, K) float32
        The frame, shrunk by area.
    wrench : (4,) float64
        fx, fy, fz in N and tz in N·mm.
    label : str
        The object.
    outside : float
        Share of the normal force that acts outside the view.
    loads : (4, rows, columns) float32
        Load on each cell of a grid over the view: fx, fy, fz in N, and the torque about the
        cell's own centre in N·mm. What acts outside the view counts in the nearest cell.
    """

    pixels: Float32
    wrench: Float64
    label: str
    outside: float
    loads: Float32


def halve_profile(profile: Profile) -> Profile:
    """Return the profile with an image of half the size, and the noise of full pixels averaged.

    Frames of it, shrunk further, look like frames of the full size and render in half the time.
    """
    image, sensor = profile.image, profile.optics.sensor
    smaller: dict[str, Any] = {
        "width_px": image.width_px // 2,
        "height_px": image.height_px // 2,
        "mm_per_px": 2 * image.mm_per_px,
    }
    quieter = sensor.model_copy(
        update={
            "full_well_e": 4 * sensor.full_well_e,
            "read_noise_e": 2 * sensor.read_noise_e,
            "jpeg_quality": "none",
        }
    )
    optics = profile.optics.model_copy(update={"sensor": quieter})
    return profile.model_copy(update={"image": image.model_copy(update=smaller), "optics": optics})


class ForceUnit:
    """One virtual unit: its reference and sequences of presses with their forces.

    Parameters
    ----------
    design : Profile
        Loaded with ``sim=True``.
    seed : int
        Of the unit, its noise and its presses.
    size : (width, height)
        Size of the samples in px.
    half : bool
        Render images of half the size.
    """

    def __init__(
        self, design: Profile, seed: int, size: tuple[int, int], *, half: bool = False
    ) -> None:
        unit = vary(design, seed)
        self.stage = VirtualStage(halve_profile(unit) if half else unit, seed)
        self.shear_modulus_mpa = unit.gel.shear_modulus_mpa
        self._thickness_mm = unit.gel.thickness_mm or np.inf
        self._size = size
        self._cells = size[0] // CELL_PX, size[1] // CELL_PX
        self._rng = np.random.default_rng([seed, 77])
        image = self.stage.profile.image
        self._view_mm = np.array([image.width_px, image.height_px]) * image.mm_per_px
        self.reference = np.asarray(np.mean([self._take_image() for _ in range(3)], 0), np.float32)

    def samples(self, objects: Sequence[ForceObject], count: int) -> Iterator[ForceSample]:
        """Yield samples of sequences: each presses one object, and then moves it."""
        done = 0
        while done < count:
            pressed = objects[int(self._rng.integers(len(objects)))]
            for sample in self._sequence(pressed):
                yield sample
                done += 1
                if done == count:
                    return

    def _sequence(self, pressed: ForceObject) -> Iterator[ForceSample]:
        rng, stage = self._rng, self.stage
        stage.reset()
        # so far from the centre that the border truncates a part of the contacts
        x_mm, y_mm = rng.uniform(-0.36, 0.36, 2) * self._view_mm
        stage.indenter(
            pressed.kind,
            x_mm=float(x_mm),
            y_mm=float(y_mm),
            angle_deg=float(rng.uniform(0, 180)),
            **pressed.sizes,
        )
        if not self._load(self._force_n()):
            return
        yield self._sample(pressed)
        way = rng.uniform(0, 2 * np.pi)
        step_mm = TRAVEL_MM * rng.uniform(0, 1) / _MOVES
        turn = rng.uniform(-1, 1) * TWIST_DEG / _MOVES * (rng.random() < 2 / 3)
        for _ in range(_MOVES):
            way += rng.normal(0, 0.4)
            far_mm = step_mm * rng.uniform(0.3, 1.7)
            stage.move(
                float(far_mm * np.cos(way)),
                float(far_mm * np.sin(way)),
                float(turn * rng.uniform(0.3, 1.7)),
            )
            if rng.random() < 0.3 and not self._load(self._force_n()):
                return
            yield self._sample(pressed)

    def _force_n(self) -> float:
        return float(0.05 + LARGEST_N * self._rng.random() ** 1.5)

    def _load(self, force_n: float) -> bool:
        """Press with this force; return False if the object would go too deep."""
        try:
            self.stage.press(force_n=force_n, steps=2)
        except InputError:
            return False
        # a linear elastic layer describes the gel up to about half of it
        return self.stage.depth_mm <= 0.55 * self._thickness_mm

    def _sample(self, pressed: ForceObject) -> ForceSample:
        stage = self.stage
        pressure = stage.state.pressure_mpa
        now_mm = stage.grid.nodes_mm + stage.state.displacement_mm[:2]
        far = (np.abs(now_mm) > self._view_mm[:, None, None] / 2).any(0)
        outside = float(pressure[far].sum() / max(float(pressure.sum()), 1e-9))
        loads = cell_loads(
            now_mm.reshape(2, -1),
            np.stack([*stage.state.grip.traction, pressure]).reshape(3, -1) * stage.grid.cell_mm2,
            self._view_mm,
            self._cells,
        )
        return ForceSample(self._take_image(), stage.wrench, pressed.name, outside, loads)

    def _take_image(self) -> Float32:
        pixels: Array = self.stage.frame().pixels.astype(np.float32)
        width, height = self._size
        small = cv2.resize(pixels, self._size, interpolation=cv2.INTER_AREA)
        return np.asarray(small, np.float32).reshape(height, width, -1)


def cell_centres_mm(view_mm: Float64, cells: tuple[int, int]) -> tuple[Float64, Float64]:
    """Return x of the columns and y of the rows of a grid over the view, from its centre."""
    x, y = (
        ((np.arange(count) + 0.5) / count - 0.5) * extent
        for count, extent in zip(cells, view_mm, strict=True)
    )
    return x, y


def cell_loads(
    places_mm: Float64, forces_n: Float64, view_mm: Float64, cells: tuple[int, int]
) -> Float32:
    """Sum forces over the cells of a grid over the view.

    Parameters
    ----------
    places_mm : (2, N)
        x and y relative to the image centre.
    forces_n : (3, N)
        Along x, y and in compression.
    view_mm : (2,)
        Width and height.
    cells : (columns, rows)

    Returns
    -------
    (4, rows, columns) float32
        As :attr:`ForceSample.loads`.
    """
    columns, rows = cells
    acting = forces_n.any(0)
    (x_mm, y_mm), forces_n = places_mm[:, acting], forces_n[:, acting]
    centres_x, centres_y = cell_centres_mm(view_mm, cells)
    column = np.clip(((x_mm / view_mm[0] + 0.5) * columns).astype(int), 0, columns - 1)
    row = np.clip(((y_mm / view_mm[1] + 0.5) * rows).astype(int), 0, rows - 1)
    torque = (x_mm - centres_x[column]) * forces_n[1] - (y_mm - centres_y[row]) * forces_n[0]
    index = row * columns + column
    sums = [np.bincount(index, part, rows * columns) for part in (*forces_n, torque)]
    return np.stack(sums).reshape(4, rows, columns).astype(np.float32)
