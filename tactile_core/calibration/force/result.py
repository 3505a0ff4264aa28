"""The result of a force calibration: the bundle with the model, and its score."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactile_core.algorithms.force_fit.cell_axes import CellRotation, ToolOffset
from tactile_core.algorithms.force_fit.clock_offset import ClockOffset
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.force.score import ComponentScore

_UNITS = {"tz_nmm": "N·mm"}


@dataclass(frozen=True, eq=False)
class ForceCalibrated:
    """A bundle with a force model, ready to save.

    Attributes
    ----------
    bundle : Bundle
    step : str
        The profile's step that uses the model.
    sequences, frames : int
    scores : mapping of str to ComponentScore
        By component, on held-out sequences.
    clock_offsets : mapping of str to ClockOffset
        By recording, for forces with a clock of their own.
    rotation : CellRotation or None
        Of the load cell's axes; None if the forces do not determine it.
    tool_offset : ToolOffset or None
        Position of the load cell's torque axis; None if the forces do not determine it.
    aligned : bool
        Whether rotation and tool offset were applied.
    notes : tuple of str
    source : Path or None
        Folder of the bundle that the model was added to.
    """

    bundle: Bundle
    step: str
    sequences: int
    frames: int
    scores: Mapping[str, ComponentScore]
    clock_offsets: Mapping[str, ClockOffset]
    rotation: CellRotation | None
    tool_offset: ToolOffset | None
    aligned: bool
    notes: tuple[str, ...]
    source: Path | None = None

    def save(self, directory: Path) -> None:
        """Write the bundle, with the report of the bundle that the model was added to.

        Raises
        ------
        InputError
            The folder holds anything but a bundle.
        OSError
            Writing fails; the previous contents remain.
        """
        self.bundle.save(directory, report=self._copy_report)

    def summary(self, directory: Path) -> dict[str, Any]:
        """Return the object that ``tactile calibrate-force --json`` prints."""
        rotation, offset = self.rotation, self.tool_offset
        return {
            "bundle": str(directory),
            "step": self.step,
            "sequences": self.sequences,
            "frames": self.frames,
            "held_out": {name: score.summary() for name, score in self.scores.items()},
            "clock_offset_s": {name: one.offset_s for name, one in self.clock_offsets.items()},
            "rotation": None
            if rotation is None
            else {"degrees": rotation.degrees, "mirrored": rotation.mirrored},
            "tool_offset_mm": None if offset is None else list(offset.mm),
            "aligned": self.aligned,
        }

    def table(self) -> tuple[list[str], list[list[str]]]:
        """Return header and rows of the table that the command prints."""
        header = ["held out", "R²", "RMSE", "of range", "within 1 σ", "proportional to", "R²"]
        rows = []
        for name, score in self.scores.items():
            near = score.proportional
            rows.append(
                [
                    name,
                    f"{score.r2:.3f}",
                    f"{score.rmse:.3g} {_UNITS.get(name, 'N')}",
                    f"{score.percent_of_range:.1f} %",
                    f"{score.within_std:.0%}",
                    "" if near is None else f"{near.feature} × {near.slope:.4g}",
                    "" if near is None else f"{near.r2:.3f}",
                ]
            )
        return header, rows

    def sentences(self) -> list[str]:
        """Return what was found about the load cell's clock, axes and position."""
        said = [
            f"{name}: the forces' clock is {one.offset_s:+.3f} s from the frames'"
            for name, one in self.clock_offsets.items()
        ]
        rotation, offset = self.rotation, self.tool_offset
        applied = "applied" if self.aligned else "not applied; --align applies it"
        if rotation is not None:
            hand = ", of the other hand" if rotation.mirrored else ""
            said.append(
                f"the load cell's x axis is at {rotation.degrees:.1f}° in the image{hand} "
                f"({applied})"
            )
        if offset is not None and offset.determined:
            x_mm, y_mm = offset.mm
            said.append(
                f"the load cell's torque axis is at ({x_mm:.2f}, {y_mm:.2f}) mm from the image "
                f"centre ({applied})"
            )
        return said

    def _copy_report(self, folder: Path) -> None:
        """Copy what the older bundle holds besides its models and reference."""
        if self.source is None:
            return
        own = {*self.bundle.manifest.artefacts, "reference.npz"}
        for name in self.bundle.manifest.files:
            if name.split("/")[0] not in own and (self.source / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(self.source / name, folder / name)
