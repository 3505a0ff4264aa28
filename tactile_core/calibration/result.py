"""The result of a calibration, and what it is made of."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, Self

import numpy as np

from tactile_core.algorithms.arrays.shrinking import gradient
from tactile_core.algorithms.poisson import integrate
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.press_search import light_of, refound, relocate_press
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.score import Score
from tactile_core.calibration.target_surface import S, TargetSurface
from tactile_core.interfaces.calibration import Calibration, Press
from tactile_core.plugins.options import measured_by
from tactile_core.quantities import Float32, Gradients, HeightMap, Reference
from tactile_core.recordings.inputs import Inputs


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A bundle that is ready to save, with its score and the presses behind it.

    Attributes
    ----------
    bundle : Bundle
    presses : tuple of TargetSurface
        All that were found, unusable ones included.
    score : Score or None
        None if it was not asked for, or fewer than two presses can be used.
    notes : tuple of str
        Warnings for the user.
    basis : str
        What the model was fitted on, for the report.
    inputs : Inputs
        Files that the calibration read.
    """

    bundle: Bundle
    presses: tuple[TargetSurface, ...]
    score: Score | None
    notes: tuple[str, ...] = ()
    basis: str = ""
    inputs: Inputs = field(default_factory=Inputs)

    def measured_with(self, words: str) -> Calibrated:
        """Return it with how the ball's diameter and the scale were measured, for the bundle."""
        manifest = self.bundle.manifest.model_copy(update={"measured_with": words.strip()})
        return replace(self, bundle=replace(self.bundle, manifest=manifest))

    def save(self, directory: Path) -> None:
        """Write the bundle and its report, completely or not at all.

        Raises
        ------
        InputError
            The folder holds an input of the calibration, or anything but a bundle.
        OSError
            Writing fails; the previous contents remain.
        """
        from tactile_core.calibration.report import write_report

        self.inputs.refuse_whole(directory)
        self.bundle.save(
            directory,
            report=lambda folder: write_report(
                folder,
                self.bundle.manifest,
                self.presses,
                self.score,
                basis=self.basis,
                coverage=self.coverage(),
                notes=self.notes,
            ),
        )

    def summary(self, directory: Path) -> dict[str, Any]:
        """Return the object that ``tactile calibrate --json`` prints."""
        return {
            "bundle": str(directory),
            "model": self.bundle.manifest.model,
            "presses": [
                {
                    "file": press.file,
                    "centre_px": [round(float(v), 3) for v in press.centre_px],
                    "contact_radius_px": round(float(press.radius_px), 3),
                    "used": press.used,
                    "why": press.why,
                }
                for press in self.presses
            ],
            "held_out": None if self.score is None else self.score.summary(),
            "coverage": self.coverage(),
        }

    def coverage(self) -> dict[str, float]:
        """Return the steepest training slope and the share of the image that presses cover."""
        good = [press for press in self.presses if press.used]
        seen = np.zeros(good[0].frame.pixels.shape[:2], bool)
        steepest = 0.0
        for press in good:
            seen |= press.area()
            slopes = press.training().gradients
            steepest = max(steepest, float(np.hypot(slopes[:, 0], slopes[:, 1]).max()))
        return {
            "slope_deg_max": round(float(np.degrees(np.arctan(steepest))), 2),
            "image_fraction": round(float(seen.mean()), 4),
        }


@dataclass(frozen=True, eq=False)
class Measured:
    """Slopes and heights of a frame, (H, W) each: one measured, the other derived from it.

    Attributes
    ----------
    gx, gy : (H, W) float32
    mm_per_px : float
    measured_mm : (H, W) float32 or None
        The heights, if they are measured.
    """

    gx: Float32
    gy: Float32
    mm_per_px: float
    measured_mm: Float32 | None = None

    @property
    def integrated(self) -> bool:
        """Whether the heights are derived from the slopes."""
        return self.measured_mm is None

    @cached_property
    def height_mm(self) -> Float32:
        """(H, W) heights; integrated only where something asks for them."""
        if self.measured_mm is not None:
            return self.measured_mm
        return integrate(self.gx, self.gy, mm_per_px=self.mm_per_px)

    @classmethod
    def from_quantity(cls, measured: Gradients | HeightMap) -> Self:
        """Take measured slopes, or differentiate heights."""
        scale = measured.mm_per_px
        if isinstance(measured, HeightMap):
            return cls(*gradient(measured.mm, scale), scale, measured.mm)
        return cls(measured.x, measured.y, scale)


def measured_frames(
    model: Calibration, surfaces: Iterable[S], undeformed: Reference
) -> Iterator[tuple[S, Measured]]:
    """Yield each surface with the measurement of its frame; a frame is measured once."""
    by_frame: dict[int, Measured] = {}
    for surface in surfaces:
        key = id(surface.frame)
        if key not in by_frame:
            by_frame[key] = Measured.from_quantity(measured_by(model, surface.frame, undeformed))
        yield surface, by_frame[key]


@dataclass(frozen=True, eq=False)
class Fold(Generic[S]):
    """Surfaces to fit on, and a way to locate those that are held out.

    Attributes
    ----------
    surfaces : sequence of TargetSurface
        The training surfaces that are used.
    reference : Reference
        The undeformed sensor, derived without the held-out pixels.
    find : callable
        Maps the index of a held-out surface to that surface, located with a light model that was
        fitted to the training surfaces alone.
    undeformed : tuple of Press
        Additional training samples of the undeformed gel surface.
    """

    surfaces: Sequence[S]
    reference: Reference
    find: Callable[[int], S]
    undeformed: tuple[Press, ...] = ()

    @property
    def samples(self) -> list[Press]:
        """All training samples."""
        return [*(surface.training() for surface in self.surfaces), *self.undeformed]


@dataclass(frozen=True, eq=False)
class SeparatePresses:
    """Presses of a ball, each in a frame of its own.

    Attributes
    ----------
    presses : sequence of FoundPress
    reference : Reference
    labelled : bool
        The circles come from labels and are not searched for.
    """

    presses: Sequence[FoundPress]
    reference: Reference
    labelled: bool = False

    def make_fold(self, held_out: Collection[int]) -> Fold[FoundPress] | None:
        """Search the circles of the other presses again, without the held-out ones.

        Returns
        -------
        Fold, or None if no other press can be used
        """
        others = [press for i, press in enumerate(self.presses) if i not in held_out]
        if self.labelled:
            used = [press for press in others if press.used]
            return Fold(used, self.reference, self.presses.__getitem__) if used else None
        used = [press for press in refound(others) if press.used]
        if not used:
            return None
        light = light_of(used)
        return Fold(used, self.reference, lambda i: relocate_press(self.presses[i], light))
