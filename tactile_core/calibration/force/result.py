"""The result of a force calibration, and its score."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force.cell_axes import CellRotation, ToolOffset
from tactile_core.algorithms.force.clock_offset import ClockOffset
from tactile_core.bundles.bundle import Bundle
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.interfaces.estimator import COMPONENTS, ForceModel, ForceSamples

Fit = Callable[[Sequence[ForceSamples]], ForceModel]


class Proportionality(NamedTuple):
    """The single feature that a component is most nearly proportional to.

    Attributes
    ----------
    feature : str
    slope : float
        N or N·mm per unit of the feature.
    r2 : float
        Of ``slope · feature``, on the frames that it was fitted to.
    """

    feature: str
    slope: float
    r2: float


class ComponentScore(NamedTuple):
    """Score of one component on held-out sequences.

    Attributes
    ----------
    r2 : float
    rmse : float
        N or N·mm.
    percent_of_range : float
        RMSE in per cent of the range of the true force.
    within_std : float
        Share of the errors within one standard deviation; 0.68 if that is right.
    proportional : Proportionality or None
        None if the features have no names.
    """

    r2: float
    rmse: float
    percent_of_range: float
    within_std: float
    proportional: Proportionality | None

    def summary(self) -> dict[str, Any]:
        """Return it as JSON-ready values."""
        proportional = None if self.proportional is None else self.proportional._asdict()
        return {**self._asdict(), "proportional": proportional}


def held_out_forces(
    sequences: Sequence[ForceSamples], fit: Fit, progress: Progress | None = None
) -> tuple[Float64, Float64]:
    """Predict each sequence by a model that was fitted on the others alone.

    Returns
    -------
    forces, std : (N, 4) float64
        In the order of the sequences.
    """
    progress = progress or Silent()
    found = []
    for index, one in enumerate(sequences):
        model = fit([other for other in sequences if other is not one])
        found.append(model.forces(one.features))
        progress.fraction((index + 1) / len(sequences))
    forces, std = zip(*found, strict=True)
    return np.concatenate(forces), np.concatenate(std)


def score_forces(
    sequences: Sequence[ForceSamples],
    found: Float64,
    std: Float64,
    names: Sequence[str] = (),
) -> dict[str, ComponentScore]:
    """Score predictions against the forces of their sequences, by component."""
    features = np.concatenate([one.features for one in sequences])
    true = np.concatenate([one.forces for one in sequences])
    scores = {}
    for column, component in enumerate(COMPONENTS):
        known = np.isfinite(true[:, column]) & np.isfinite(found[:, column])
        if known.sum() < 2:
            continue
        force, miss = true[known, column], (found - true)[known, column]
        rmse = float(np.sqrt((miss**2).mean()))
        scores[component] = ComponentScore(
            _r2(force, miss),
            rmse,
            100 * rmse / max(float(np.ptp(force)), 1e-300),
            float((np.abs(miss) <= std[known, column]).mean()),
            _proportional(features[known], force, names),
        )
    return scores


def _proportional(
    features: Float64, force: Float64, names: Sequence[str]
) -> Proportionality | None:
    found = []
    for column, name in enumerate(names):
        one = features[:, column]
        size = float(one @ one)
        if np.isfinite(size) and size > 0:
            slope = float(one @ force) / size
            found.append(Proportionality(name, slope, _r2(force, slope * one - force)))
    return max(found, key=lambda one: one.r2, default=None)


def _r2(force: Float64, miss: Float64) -> float:
    return 1 - float(miss @ miss) / max(float(((force - force.mean()) ** 2).sum()), 1e-300)


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
