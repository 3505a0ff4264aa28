"""Calibrations by presses of a ball, through the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from support.command_line import tactile

from tactile_sim import VirtualStage
from tactile_sim.simulation import press_balls


def calibrated(
    profile: Path | str, presses: Path, reference: Path, ball_mm: float, out: Path
) -> dict[str, Any]:
    """Return the report of ``tactile calibrate``."""
    done = tactile(
        *("calibrate", profile, "--presses", presses, "--reference", reference),
        *("--ball-diameter-mm", ball_mm, "--out", out, "--json"),
    )
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def virtually_calibrated(profile: Path | str, folder: Path) -> dict[str, Any]:
    """Return the report of a calibration on twelve presses of the profile's virtual sensor."""
    ball_mm = press_balls(VirtualStage(str(profile)), folder, count=12)
    return calibrated(profile, folder / "presses", folder / "reference", ball_mm, folder / "bundle")


def used(report: dict[str, Any]) -> int:
    """Return the number of presses that were good enough."""
    return sum(press["used"] for press in report["presses"])


def radius_ratio(report: dict[str, Any]) -> float:
    """Return the radius of held-out spheres over the ball's, in the median."""
    return float(report["held_out"]["sphere_radius_ratio"]["median"])


def error_deg(report: dict[str, Any]) -> float:
    """Return the mean error of held-out normals."""
    return float(report["held_out"]["normal_error_deg"]["mean"])
