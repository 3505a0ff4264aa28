"""Accuracy of marker tracking on recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from experiments import marker_recordings
from experiments.table_row import Row, command


def rows(data: Path) -> list[Row]:
    """Track markers from the first frame on."""
    fields = marker_recordings.followed(data / marker_recordings.MINI, marker_recordings.MINI_SIZE)
    off_px, swapped = marker_recordings.against_labels(data, fields)
    rest_px = np.hypot(*np.moveaxis(np.array([f.px - fields[0].px for f in fields]), -1, 0))
    kept = {"mini": float(100 * marker_recordings.through(fields).mean())}
    irregular = marker_recordings.followed(
        data / marker_recordings.IRREGULAR, marker_recordings.IRREGULAR_SIZE
    )
    kept["irregular_markers"] = float(100 * marker_recordings.through(irregular).mean())
    return [
        Row(
            "markers_distance",
            "95th percentile of the distance between markers and labels, px",
            "markers/mini: a GelSight Mini; labels of another tracker, accurate to about 0.25 px",
            f"{off_px.shape[1]} markers in {off_px.shape[0]} frames",
            "nothing is fitted",
            {"mini": float(np.percentile(off_px, 95))},
            float(np.percentile(off_px, 95)),
            {"predict no motion": float(np.percentile(rest_px[-len(off_px) :], 95))},
            command("markers"),
            {"mean, px": float(off_px.mean()), "swapped": float(swapped)},
        ),
        Row(
            "markers_kept",
            "markers detected in every frame, %",
            "markers/mini and markers/irregular_markers.avi",
            f"{len(fields[0].px)} and {len(irregular[0].px)} markers in {len(fields)} and "
            f"{len(irregular)} frames",
            "nothing is fitted",
            kept,
            min(kept.values()),
            {},
            command("markers"),
        ),
    ]
