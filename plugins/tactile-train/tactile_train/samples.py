"""Samples for the training, virtual and recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.errors import InputError
from tactile_core.formats.labels import read_forces
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.formats.text import shorten_repr
from tactile_core.interfaces.calibration import Progress
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.model import Profile
from tactile_train.virtual_forces import CELL_PX, ForceObject, ForceUnit

# Width of the samples: a marker of the fingertips is four pixels wide, so its motion shows.
WIDTH_PX = 160


@dataclass(frozen=True, eq=False)
class UnitSamples:
    """Samples of one unit, or of one recording.

    Attributes
    ----------
    images : (N, H, W, K) float16
        Frames, shrunk by area.
    reference : (H, W, K) float32
    wrenches : (N, 4) float64
        N, N, N and N·mm.
    shear_modulus_mpa : float
        Of the unit's gel; 1 if it is unknown.
    labels : (N,) str
        Object or sequence.
    outside : (N,) float64
        Share of the normal force outside the view; 0 if it is unknown.
    loads : (N, 4, H / 8, W / 8) float32 or None
        Loads on the cells; None if they are unknown.
    """

    images: NDArray[np.float16]
    reference: Float32
    wrenches: NDArray[np.float64]
    shear_modulus_mpa: float
    labels: NDArray[Any]
    outside: NDArray[np.float64]
    loads: Float32 | None = None

    @property
    def relative(self) -> Float32:
        """(N, 4) float32 wrenches over the gel's shear modulus."""
        return np.asarray(self.wrenches / self.shear_modulus_mpa, np.float32)

    def part(self, chosen: NDArray[Any]) -> Self:
        """Return some of the samples."""
        return type(self)(
            self.images[chosen],
            self.reference,
            self.wrenches[chosen],
            self.shear_modulus_mpa,
            self.labels[chosen],
            self.outside[chosen],
            None if self.loads is None else self.loads[chosen],
        )

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the arrays of :meth:`from_arrays`."""
        named: dict[str, NDArray[Any]] = {
            "images": self.images,
            "reference": self.reference,
            "wrenches": self.wrenches,
            "shear_modulus_mpa": np.array(self.shear_modulus_mpa),
            "labels": self.labels,
            "outside": self.outside,
        }
        return named if self.loads is None else named | {"loads": self.loads}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild the samples from :meth:`arrays`."""
        return cls(
            arrays["images"],
            arrays["reference"],
            arrays["wrenches"],
            float(arrays["shear_modulus_mpa"]),
            arrays["labels"],
            arrays["outside"],
            arrays.get("loads"),
        )


def sample_size(profile: Profile) -> tuple[int, int]:
    """Return width and height of the samples in px, multiples of a cell of the load grid."""
    image = profile.image
    height = WIDTH_PX * image.height_px / image.width_px / CELL_PX
    return WIDTH_PX, CELL_PX * max(1, round(height))


def virtual_samples(
    design: Profile, unit: int, objects: Sequence[ForceObject], count: int, *, half: bool
) -> UnitSamples:
    """Render samples of one virtual unit.

    Parameters
    ----------
    design : Profile
        Loaded with ``sim=True``.
    unit : int
        Number of the unit.
    objects : sequence of ForceObject
    count : int
    half : bool
        Render at half the size, which takes half the time.
    """
    made = ForceUnit(design, unit, sample_size(design), half=half)
    found = list(made.samples(objects, count))
    return UnitSamples(
        np.stack([one.pixels for one in found]).astype(np.float16),
        made.reference,
        np.stack([one.wrench for one in found]),
        made.shear_modulus_mpa or 1.0,
        np.array([one.label for one in found]),
        np.array([one.outside for one in found]),
        np.stack([one.loads for one in found]),
    )


def kept_samples(path: Path, design: Profile, unit: int, **rendered: Any) -> UnitSamples:
    """Read samples that an earlier run has written, or render and write them."""
    if path.is_file():
        return UnitSamples.from_arrays(read_npz(path))
    found = virtual_samples(design, unit, **rendered)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_npz(path, found.arrays())
    return found


def mirrored_channels(azimuths_deg: Sequence[float]) -> tuple[int, ...] | None:
    """Return the order of the channels in which a mirrored image is one of the same design.

    Mirroring x turns a light at azimuth a into one at 180° − a.

    Parameters
    ----------
    azimuths_deg : sequence of float
        Of the lights, in the order of the channels.

    Returns
    -------
    tuple of int or None
        None if the design has no such symmetry.
    """
    order = []
    for azimuth in azimuths_deg:
        turned = [abs((180 - azimuth - other + 180) % 360 - 180) for other in azimuths_deg]
        if not turned or min(turned) > 1.0:
            return None
        order.append(int(np.argmin(turned)))
    return tuple(order) if order else None


_PARTS = 5  # Of a recording without named sequences


def recorded_samples(
    profile: Profile, input: Path, forces: Path, reference: Path | str | None, progress: Progress
) -> dict[str, UnitSamples]:
    """Return the labelled frames of a recording, by sequence.

    Without at least three names in the column ``sequence``, the recording is divided into five
    parts of equal length.

    Raises
    ------
    InputError
        Frames and forces do not match, a component is missing, or there is no reference.
    """
    table = read_forces(forces)
    if table.key == "time_s" or not np.isfinite(table.forces).all():
        raise InputError(
            f"{forces}: training needs all of fx_n, fy_n, fz_n and tz_nmm in each line, and "
            f"'frame' or 'file'"
        )
    if len(table.rows) < _PARTS:
        raise InputError(
            f"{forces} has {len(table.rows)} forces; give at least {_PARTS}, since some are held "
            f"out"
        )
    row_of = {name: row for row, name in enumerate(table.rows)}
    size = sample_size(profile)
    plain = profile.model_copy(update={"estimators": {}})
    images: list[Float32] = []
    rows: list[int] = []
    with open_sensor(plain, input=input, reference=reference) as sensor:
        undeformed = sensor.pipeline.reference
        if undeformed is None:
            raise InputError(
                "training needs the undeformed sensor; give --reference, a recording of it"
            )
        base = _small(undeformed.pixels, size)
        for reading in sensor.stream():
            frame = reading.frame
            row = row_of.get(table.name_of(frame.sequence, reading.source))
            if row is not None:
                images.append(_small(frame.pixels, size))
                rows.append(row)
                progress.fraction(len(rows) / len(table.rows))
    absent = sorted(set(range(len(table.rows))) - set(rows))
    if absent:
        raise InputError(
            f"{forces} has a force for the {table.key} {shorten_repr(table.rows[absent[0]])}, "
            f"which {input} does not contain; give the forces of this recording"
        )
    sequences = np.array([table.sequences[row] for row in rows])
    if len(set(sequences)) < 3:  # for training, for the standard deviations, and for the score
        count = len(rows)
        sequences = np.array([f"part {1 + _PARTS * k // count}" for k in range(count)])
    stack = np.stack(images).astype(np.float16)
    modulus = profile.gel.shear_modulus_mpa or 1.0
    nothing = np.zeros(len(rows))
    whole = UnitSamples(stack, base, table.forces[rows], modulus, sequences, nothing)
    return {str(name): whole.part(sequences == name) for name in np.unique(sequences)}


def _small(pixels: Float32, size: tuple[int, int]) -> Float32:
    small = cv2.resize(np.asarray(pixels, np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32).reshape(size[1], size[0], -1)
