"""Measured against true normals on a pressed ball: yaw and pitch of every pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.report import REPORT, scatter
from tactile_core.calibration.targets import balls, undeformed_sensor
from tactile_core.errors import InputError
from tactile_core.interfaces.calibrator import Progress, Silent
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Gradients
from tactile_core.views import html


@dataclass(frozen=True)
class NormalErrors:
    """Errors of the normals of one press, or of all.

    Attributes
    ----------
    name : str
        File of the press, or ``all``.
    pixels : int
        Pixels within 0.8 of the contact radius.
    mean_deg : float
        Mean angle between measured and true normals.
    pitch_rmse_deg, yaw_rmse_deg : float
        Root-mean-square errors. Yaw counts where the true pitch is above 5°.
    pitch_slope : float
        Measured over true pitch: slope of the line through the origin.
    """

    name: str
    pixels: int
    mean_deg: float
    pitch_rmse_deg: float
    yaw_rmse_deg: float
    pitch_slope: float


@dataclass(frozen=True, eq=False)
class MeasuredNormals:
    """Normals of all presses of a recording.

    Attributes
    ----------
    rows : tuple of NormalErrors
        One for each usable press, then that of all.
    left_out : tuple of (str, str)
        Presses without a usable circle, and why.
    slopes : (N, 4) float
        Measured and true slopes of all pixels.
    """

    rows: tuple[NormalErrors, ...]
    left_out: tuple[tuple[str, str], ...]
    slopes: Array

    def summary(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"presses": [asdict(row) for row in self.rows], "left_out": list(self.left_out)}

    def page(self) -> str:
        """Return a page with both scatter plots and the table."""
        step = max(1, len(self.slopes) // _PLOTTED)
        pitch, yaw, steep = _angles(self.slopes[::step])
        names = "pitch", "yaw"
        plots = (
            scatter(pitch[1], pitch[0], 0, REPORT.pitch_deg),
            scatter(yaw[1][steep], yaw[0][steep], -180, 180),
        )
        parts = [
            html.figure(plot, f"{name} in degrees: measured (vertical) against true (horizontal)")
            for plot, name in zip(plots, names, strict=True)
        ]
        header, rows = normals_table(self.rows)
        return html.page("Normals on a ball", [html.row(parts), html.table(header, rows)])


_PLOTTED = 4000  # Pixels in a plot, at most


def evaluate_normals(
    profile: str | Path,
    *,
    input: Path,
    bundle: Path,
    ball_diameter_mm: float,
    reference: Path | None = None,
    progress: Progress | None = None,
) -> MeasuredNormals:
    """Find the ball in each frame, and compare measured normals with its own.

    Parameters
    ----------
    profile : str or Path
    input : Path
        A recording of the ball, pressed somewhere in each frame; not that of the calibration.
    bundle : Path
    ball_diameter_mm : float
    reference : Path, optional
        A recording of the undeformed sensor. Default: the reference in the bundle.

    Raises
    ------
    InputError, CalibrationError
        No press can be used, or the calibration measures heights instead of slopes.

    References
    ----------
    .. [1] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
       Estimating Geometry and Force", Sensors 17(12), 2017, figure 13.
    """
    base, fitted = load_profile(profile), Bundle.load(bundle)
    frames = list(read_frames(base, input))
    undeformed, _ = undeformed_sensor(base, frames, reference, None, fitted.reference)
    pipeline = Pipeline(base, fitted, undeformed)
    if Gradients not in pipeline.gives:
        raise InputError("the calibration measures no slopes; give the bundle of one that does")
    target = balls(
        base,
        input,
        frames,
        pipeline.conditioning,
        ball_diameter_mm=ball_diameter_mm,
        progress=progress or Silent(),
    )
    rows, slopes = [], []
    for press, frame in zip(target.surfaces, frames, strict=True):
        if not press.used:
            continue
        measured = pipeline.process(frame)[Gradients]
        at_rows, at_columns, true = press.true_gradients(press.scored_area())
        found = np.stack([measured.x[at_rows, at_columns], measured.y[at_rows, at_columns]], 1)
        slopes.append(np.column_stack([found, true]))
        rows.append(_errors(press.file, slopes[-1]))
    every = np.concatenate(slopes)
    left_out = tuple((press.file, press.why) for press in target.surfaces if not press.used)
    return MeasuredNormals((*rows, _errors("all", every)), left_out, every)


def normals_table(rows: Sequence[NormalErrors]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of a table."""
    header = ["press", "pixels", "normal error", "pitch RMSE", "yaw RMSE", "pitch, measured/true"]
    return header, [
        [
            row.name,
            str(row.pixels),
            f"{row.mean_deg:.2f}°",
            f"{row.pitch_rmse_deg:.2f}°",
            f"{row.yaw_rmse_deg:.2f}°",
            f"{row.pitch_slope:.3f}",
        ]
        for row in rows
    ]


def _errors(name: str, slopes: Array) -> NormalErrors:
    pitch, yaw, steep = _angles(slopes)
    turned = (yaw[0] - yaw[1] + 180) % 360 - 180
    return NormalErrors(
        name,
        len(slopes),
        float(angles_deg(slopes[:, :2], slopes[:, 2:]).mean()),
        float(np.sqrt(np.mean((pitch[0] - pitch[1]) ** 2))),
        float(np.sqrt(np.mean(turned[steep] ** 2))) if steep.any() else 0.0,
        float(np.sum(pitch[0] * pitch[1]) / np.sum(pitch[1] ** 2)),
    )


def _angles(slopes: Array) -> tuple[Array, Array, Array]:
    """Pitch and yaw in degrees, (2, N), measured and true; and where yaw is defined."""
    both = np.stack([slopes[:, :2], slopes[:, 2:]])
    pitch = np.degrees(np.arctan(np.hypot(both[..., 0], both[..., 1])))
    yaw = np.degrees(np.arctan2(both[..., 1], both[..., 0]))
    return pitch, yaw, pitch[1] > REPORT.steep_deg
