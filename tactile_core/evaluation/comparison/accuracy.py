"""The accuracy of results against a truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.calibration.presses import angles_deg
from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz

Arrays = Mapping[str, NDArray[Any]]

# Arrays that are not measured quantities, so they have no ground truth.
_WITHOUT_TRUTH = frozenset({"valid", "mm_per_px"})


@dataclass(frozen=True)
class Truth:
    """A folder of ``NAME.npz`` with ground truth under the names that ``tactile run`` writes."""

    folder: Path

    def check(self, names: list[str]) -> None:
        """Check that the folder has the truth of every frame.

        Raises
        ------
        InputError
            A file is missing; the message names it and the file with the most similar name.
        """
        if not self.folder.is_dir():
            raise InputError(f"{self.folder}: there is no such folder; correct --truth")
        there = sorted(path.stem for path in self.folder.glob("*.npz"))
        for name in names:
            if name not in there:
                near = get_close_matches(name, there, 1)
                nearest = f"the nearest is {near[0]}.npz" if near else f"it has {len(there)} .npz"
                raise InputError(
                    f"{self.folder} has no {name}.npz with the truth of that frame ({nearest}); "
                    f"give the truth of this recording"
                )

    def read_arrays(self, name: str) -> Arrays:
        """Read the true arrays of a frame; raises as :meth:`check` if they are missing."""
        path = self.path(name)
        if not path.is_file():
            self.check([name])
        return read_npz(path)

    def path(self, name: str) -> Path:
        """Path of a frame's ground truth."""
        return self.folder / f"{name}.npz"


def common_names(measured: Arrays, truth: Arrays, path: Path) -> list[str]:
    """Return the names of numeric arrays that both have.

    Lists of markers are left out, because their correspondence is unknown.

    Raises
    ------
    InputError
        The shapes of an array differ, the scales differ by more than 1 %, or the true scale is
        not one number.
    """
    if "mm_per_px" in measured and "mm_per_px" in truth:
        true, scale = _scale(truth["mm_per_px"], path), float(measured["mm_per_px"])
        if abs(true / scale - 1) > 0.01:  # [ratio]
            raise InputError(
                f"{path} has {true:g} mm per pixel and the recording {scale:g}; give the truth of "
                f"this recording"
            )
    names = []
    for name in measured:
        if name not in truth or name in _WITHOUT_TRUTH or name.startswith("marker"):
            continue
        if not (_is_number(measured[name]) and _is_number(truth[name])):
            continue
        _check_size(truth[name].shape, measured[name].shape, f"{path}: {name}")
        if measured[name].ndim > 1 and "contact" in truth:
            # the true contact masks the other arrays, even if no contact was measured
            _check_size(truth["contact"].shape, measured[name].shape[:2], f"{path}: contact")
        if not np.isfinite(truth[name]).all():
            raise InputError(f"{path}: {name} is not finite everywhere; write the truth again")
        names.append(name)
    return names


def _scale(array: NDArray[Any], path: Path) -> float:
    if array.size != 1 or not _is_number(array):
        raise InputError(f"{path}: mm_per_px is not one number; write the truth again")
    return float(array.item())


def _is_number(array: NDArray[Any]) -> bool:
    return array.dtype.kind in "biuf"


def _check_size(true: tuple[int, ...], measured: tuple[int, ...], what: str) -> None:
    if true != measured:
        raise InputError(
            f"{what} is {_format_shape(true)} but {_format_shape(measured)} was measured; give the "
            f"truth of this recording"
        )


def _format_shape(shape: tuple[int, ...]) -> str:
    return " × ".join(str(side) for side in shape) or "one number"


_BINS_PER_DEG = 100  # Resolution of the histogram of angles: quantiles are exact to 0.01°


class Angles:
    """Streaming statistics of angles; quantiles are accurate to 0.01°."""

    def __init__(self) -> None:
        self._sum = 0.0
        self._counts = np.zeros(180 * _BINS_PER_DEG + 1, np.int64)

    def add(self, angles_deg: NDArray[Any]) -> None:
        """Count (N,) angles, 0..180."""
        self._sum += float(angles_deg.sum(dtype=np.float64))
        bins = np.rint(angles_deg * _BINS_PER_DEG).astype(np.int64)
        self._counts += np.bincount(bins, minlength=len(self._counts))

    def summary(self) -> dict[str, float] | None:
        """``mean``, ``median`` and ``p90`` in degrees; None without any angle."""
        total = int(self._counts.sum())
        if total == 0:
            return None
        below = np.cumsum(self._counts)
        median, p90 = (
            int(np.searchsorted(below, share * total)) / _BINS_PER_DEG for share in (0.5, 0.9)
        )
        return {"mean": round(self._sum / total, 4), "median": median, "p90": p90}


class Squares:
    """Root mean square of pooled errors."""

    def __init__(self) -> None:
        self._sum: NDArray[Any] = np.zeros(())
        self._count = 0

    def add(self, squares: NDArray[Any]) -> None:
        """Count (N, …) squared errors; the mean is taken over the first axis."""
        self._sum = self._sum + squares.sum(axis=0, dtype=np.float64)
        self._count += len(squares)

    def summary(self) -> Any:
        """A number or a list of numbers; None without any error."""
        return np.sqrt(self._sum / self._count).round(6).tolist() if self._count else None


class Accuracy:
    """Accumulates the scores of one variant over frames."""

    def __init__(self) -> None:
        self._normals, self._contact_normals = Angles(), Angles()
        self._height, self._contact_height = Squares(), Squares()
        self._peaks: list[float] = []
        self._overlap: defaultdict[str, list[int]] = defaultdict(lambda: [0, 0])
        self._others: defaultdict[str, Squares] = defaultdict(Squares)

    def add(self, measured: Arrays, truth: Arrays, names: list[str]) -> None:
        """Count one frame.

        Parameters
        ----------
        measured, truth : mapping of name to array
            Finite; arrays that are compared have the same shape in both.
        names : list of str
            Arrays to compare.
        """
        contact = truth["contact"].astype(bool) if "contact" in truth else None
        for name in names:
            array, true = measured[name], truth[name]
            if name == "gradients":
                self._add_normals(array, true, contact)
            elif name == "height_mm":
                self._add_height(array, true, contact)
            elif array.dtype == bool:
                overlap, true_mask = self._overlap[name], true.astype(bool)
                overlap[0] += int(np.count_nonzero(array & true_mask))
                overlap[1] += int(np.count_nonzero(array | true_mask))
            elif true.ndim < 2:
                self._others[name].add(np.square(array.astype(np.float64) - true)[None])
            else:
                squares = np.square(array.astype(np.float64) - true)
                self._others[name].add(squares.reshape(*true.shape[:2], -1).sum(2).ravel())

    def summary(self) -> dict[str, Any]:
        """Every score, JSON-ready; None if nothing was compared.

        ``rmse`` has an entry for every other array: the length of the error for a vector field,
        one value per component for a short vector such as a wrench.
        """
        return {
            "normal_error_deg": self._normals.summary(),
            "normal_error_in_contact_deg": self._contact_normals.summary(),
            "height_rmse_mm": self._height.summary(),
            "height_rmse_in_contact_mm": self._contact_height.summary(),
            "peak_error_mm": round(float(np.mean(self._peaks)), 6) if self._peaks else None,
            "iou": {
                name: round(both / either, 6) if either else None
                for name, (both, either) in self._overlap.items()
            },
            "rmse": {name: squares.summary() for name, squares in self._others.items()},
        }

    def _add_normals(
        self, gradients: NDArray[Any], true: NDArray[Any], contact: NDArray[Any] | None
    ) -> None:
        angles = angles_deg(gradients.reshape(-1, 2), true.reshape(-1, 2))
        self._normals.add(angles)
        if contact is not None:
            self._contact_normals.add(angles[contact.ravel()])

    def _add_height(
        self, height_mm: NDArray[Any], true: NDArray[Any], contact: NDArray[Any] | None
    ) -> None:
        squares = np.square(height_mm.astype(np.float64) - true)
        self._height.add(squares.ravel())
        if contact is not None:
            self._contact_height.add(squares[contact])
        self._peaks.append(abs(float(height_mm.max()) - float(true.max())))
