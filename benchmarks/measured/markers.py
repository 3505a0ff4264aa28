"""Printed marks, followed from the first frame on."""

from __future__ import annotations

from pathlib import Path

import marker_tracking
import numpy as np

from measured.row import Row, command


def rows(data: Path) -> list[Row]:
    """Follow marks from the first frame on."""
    fields = marker_tracking.followed(data / marker_tracking.MINI, marker_tracking.MINI_SIZE)
    off_px, swapped = marker_tracking.against_labels(data, fields)
    resting_px = np.hypot(*np.moveaxis(np.array([f.px - fields[0].px for f in fields]), -1, 0))
    kept = {"mini": float(100 * marker_tracking.through(fields).mean())}
    irregular = marker_tracking.followed(
        data / marker_tracking.IRREGULAR, marker_tracking.IRREGULAR_SIZE
    )
    kept["irregular_markers"] = float(100 * marker_tracking.through(irregular).mean())
    return [
        Row(
            "markers_distance",
            "95 % of marks are nearer to their labels than, px",
            "markers/mini: a GelSight Mini; labels of another tracker, itself about 0.25 px",
            f"{off_px.shape[1]} marks in {off_px.shape[0]} frames",
            "nothing is fitted",
            {"mini": float(np.percentile(off_px, 95))},
            float(np.percentile(off_px, 95)),
            {"say that no mark moves": float(np.percentile(resting_px[-len(off_px) :], 95))},
            command("markers"),
            {"mean, px": float(off_px.mean()), "swapped": float(swapped)},
        ),
        Row(
            "markers_kept",
            "marks seen in every frame, %",
            "markers/mini and markers/irregular_markers.avi",
            f"{len(fields[0].px)} and {len(irregular[0].px)} marks in {len(fields)} and "
            f"{len(irregular)} frames",
            "nothing is fitted",
            kept,
            min(kept.values()),
            {},
            command("markers"),
        ),
    ]
