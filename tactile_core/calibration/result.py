"""The result of a calibration: the bundle, its score and the presses behind it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.score import Score
from tactile_core.calibration.target_surface import TargetSurface
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
