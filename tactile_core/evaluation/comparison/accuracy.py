"""How far measured arrays are from true ones, pooled over all pixels of all frames."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.calibration.presses import angles_deg
from tactile_core.evaluation.comparison.truth import Arrays

_BINS_PER_DEG = 100


class Angles:
    """Angles pooled without keeping them: quantiles are good to a hundredth of a degree."""

    def __init__(self) -> None:
        self._sum = 0.0
        self._counts = np.zeros(180 * _BINS_PER_DEG + 1, np.int64)

    def add(self, angles_deg: NDArray[Any]) -> None:
        """Count (N,) angles, 0..180."""
        self._sum += float(angles_deg.sum(dtype=np.float64))
        bins = np.rint(angles_deg * _BINS_PER_DEG).astype(np.int64)
        self._counts += np.bincount(bins, minlength=len(self._counts))

    def summary(self) -> dict[str, float] | None:
        """``mean``, ``median`` and ``p90``, degrees; None where nothing was counted."""
        total = int(self._counts.sum())
        if total == 0:
            return None
        below = np.cumsum(self._counts)
        median, p90 = (
            int(np.searchsorted(below, share * total)) / _BINS_PER_DEG for share in (0.5, 0.9)
        )
        return {"mean": round(self._sum / total, 4), "median": median, "p90": p90}


class Squares:
    """Root of the mean square of pooled errors."""

    def __init__(self) -> None:
        self._sum: NDArray[Any] = np.zeros(())
        self._count = 0

    def add(self, squares: NDArray[Any]) -> None:
        """Count (N, …) squared errors; each entry behind the first axis has a mean of its own."""
        self._sum = self._sum + squares.sum(axis=0, dtype=np.float64)
        self._count += len(squares)

    def summary(self) -> Any:
        """A number, or a list of them; None where nothing was counted."""
        return np.sqrt(self._sum / self._count).round(6).tolist() if self._count else None


class Accuracy:
    """Scores of one variant: frame after frame is added, then they are summed up."""

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
            Finite; those named have equal sizes in both.
        names : list of str
            What to compare.
        """
        contact = truth["contact"].astype(bool) if "contact" in truth else None
        for name in names:
            mine, true = measured[name], truth[name]
            if name == "gradients":
                self._add_normals(mine, true, contact)
            elif name == "height_mm":
                self._add_height(mine, true, contact)
            elif mine.dtype == bool:
                overlap, there = self._overlap[name], true.astype(bool)
                overlap[0] += int(np.count_nonzero(mine & there))
                overlap[1] += int(np.count_nonzero(mine | there))
            elif true.ndim < 2:
                self._others[name].add(np.square(mine.astype(np.float64) - true)[None])
            else:
                squares = np.square(mine.astype(np.float64) - true)
                self._others[name].add(squares.reshape(*true.shape[:2], -1).sum(2).ravel())

    def summary(self) -> dict[str, Any]:
        """Every score, JSON-ready; None where there was nothing to compare.

        ``rmse`` has an entry for each other array: of a field of vectors the length of the error,
        of a few numbers (a wrench) each by itself.
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
        self, mine: NDArray[Any], true: NDArray[Any], contact: NDArray[Any] | None
    ) -> None:
        angles = angles_deg(mine.reshape(-1, 2), true.reshape(-1, 2))
        self._normals.add(angles)
        if contact is not None:
            self._contact_normals.add(angles[contact.ravel()])

    def _add_height(
        self, mine: NDArray[Any], true: NDArray[Any], contact: NDArray[Any] | None
    ) -> None:
        squares = np.square(mine.astype(np.float64) - true)
        self._height.add(squares.ravel())
        if contact is not None:
            self._contact_height.add(squares[contact])
        self._peaks.append(abs(float(mine.max()) - float(true.max())))
