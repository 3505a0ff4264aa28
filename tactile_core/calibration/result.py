"""What a calibration came to: a bundle that is ready to save, and how it came about."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.known_surface import KnownSurface
from tactile_core.calibration.scoring import Score
from tactile_core.recordings.inputs import Inputs


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A bundle that is ready to save, and how it came about."""

    bundle: Bundle
    presses: tuple[KnownSurface, ...]
    score: Score | None
    notes: tuple[str, ...] = ()
    basis: str = ""
    inputs: Inputs = field(default_factory=Inputs)

    def save(self, directory: Path) -> None:
        """Write the bundle with its report, whole or not at all.

        Raises
        ------
        InputError
            The folder holds something of what this was made from, or anything but a bundle.
        OSError
            The disk is full or refuses; what was there before is still there.
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
        """What ``tactile calibrate --json`` prints."""
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
        """Steepest slope that was pressed, and the share of the image that some press covered."""
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
