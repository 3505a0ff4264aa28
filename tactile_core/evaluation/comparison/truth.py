"""The truth beside a recording: one ``.npz`` per frame, under the frame's name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.npz import read_npz

Arrays = Mapping[str, NDArray[Any]]

_SCALE_TOLERANCE = 0.01
_OF_THE_MEASUREMENT = frozenset({"valid", "mm_per_px"})
"""Arrays that are no measured quantity, so there is no truth of them."""


@dataclass(frozen=True)
class Truth:
    """A folder of ``NAME.npz`` with the arrays that ``tactile run`` writes, but true."""

    folder: Path

    def check(self, names: list[str]) -> None:
        """Refuse a folder that lacks the truth of a frame.

        Raises
        ------
        InputError
            With the frame that is missing and the file that is nearest to it.
        """
        if not self.folder.is_dir():
            raise InputError(f"{self.folder}: there is no such folder; --truth names one")
        there = sorted(path.stem for path in self.folder.glob("*.npz"))
        for name in names:
            if name not in there:
                near = get_close_matches(name, there, 1)
                nearest = f"the nearest is {near[0]}.npz" if near else f"it has {len(there)} .npz"
                raise InputError(
                    f"{self.folder} holds no {name}.npz, the truth of that frame ({nearest}); "
                    f"name the truth of this very recording"
                )

    def of(self, name: str) -> Arrays:
        """Read the true arrays of a frame; one that is missing is refused as by :meth:`check`."""
        path = self.path(name)
        if not path.is_file():
            self.check([name])
        return read_npz(path)

    def path(self, name: str) -> Path:
        """Where the truth of a frame is."""
        return self.folder / f"{name}.npz"


def common_names(measured: Arrays, truth: Arrays, path: Path) -> list[str]:
    """Return the arrays that both have and that can be told apart in numbers.

    Lists of markers are left out: which of them is which is not known.

    Raises
    ------
    InputError
        An array differs in size, or the scales by more than 1 %.
    """
    scales = [
        float(arrays["mm_per_px"].item()) for arrays in (measured, truth) if "mm_per_px" in arrays
    ]
    if len(scales) == 2 and abs(scales[1] / scales[0] - 1) > _SCALE_TOLERANCE:
        raise InputError(
            f"{path} is at {scales[1]:g} mm per pixel and the recording at {scales[0]:g}; give the "
            f"truth of this very recording"
        )
    names = []
    for name in measured:
        if name not in truth or name in _OF_THE_MEASUREMENT or name.startswith("marker"):
            continue
        if not (_is_number(measured[name]) and _is_number(truth[name])):
            continue
        _check_size(truth[name].shape, measured[name].shape, f"{path}: {name}")
        if measured[name].ndim > 1 and "contact" in truth:
            # it says which pixels of the others are in contact, also where none was measured
            _check_size(truth["contact"].shape, measured[name].shape[:2], f"{path}: contact")
        if not np.isfinite(truth[name]).all():
            raise InputError(f"{path}: {name} is not finite everywhere; write the truth again")
        names.append(name)
    return names


def _is_number(array: NDArray[Any]) -> bool:
    return array.dtype.kind in "biuf"


def _check_size(true: tuple[int, ...], measured: tuple[int, ...], what: str) -> None:
    if true != measured:
        raise InputError(
            f"{what} is {_words(true)} and what was measured {_words(measured)}; give the truth of "
            f"this very recording"
        )


def _words(shape: tuple[int, ...]) -> str:
    return " × ".join(str(side) for side in shape) or "one number"
