"""Markers of a new sensor, from its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tactile_core.algorithms.markers.contrast import Tone
from tactile_core.algorithms.markers.count import expected_count, find_detectable_lattice, too_few
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Pixels


@dataclass(frozen=True)
class PictureFinding:
    """Keys of one section of a profile, and the origin of their values.

    Attributes
    ----------
    section : str
        ``image`` or ``gel``, for example.
    comment : str
        Meaning and origin of the keys, in a sentence or two.
    values : mapping
        Keys and values for the file; empty if the parent's values are inherited.
    noted : bool
        Also reported to the user: the values are inherited instead of measured, or doubtful.
    """

    section: str
    comment: str
    values: Mapping[str, Any] = field(default_factory=dict)
    noted: bool = False


@dataclass(frozen=True)
class FoundMarkers:
    """Tone, typical diameter and pitch of the markers in the resulting image, and their number.

    They fit if their number does not contradict their pitch.
    """

    tone: Tone
    diameter_px: float
    pitch_px: float
    count: int
    expected: int
    fits: bool


def find_markers(exposures: Sequence[Pixels]) -> FoundMarkers | None:
    """Detect whether the gel has printed markers, and their size.

    Parameters
    ----------
    exposures : sequence of (H, W) or (H, W, 3)
        Exposures of one observation in the resulting image.

    Returns
    -------
    FoundMarkers, or None without a lattice of markers
    """
    planes = np.concatenate([np.atleast_3d(exposure) for exposure in exposures], axis=2)
    level = np.maximum(np.median(planes.reshape(-1, planes.shape[2]), axis=0), 1.0)
    relative = planes / level.astype(np.float32)
    # Ink is dark, or bright, in all lights; a slope is bright in some and dark in others. Between
    # the slopes of pressed objects, level gel is only as bright as most of it.
    found = find_detectable_lattice(relative.max(axis=2), ["dark"])
    found = found or find_detectable_lattice(relative.min(axis=2).clip(1), ["bright"])
    if found is None:
        return None
    lattice, count = found
    shape, pitch_px = planes.shape, lattice.pitch_px
    fits = not too_few(count, shape, pitch_px)
    return FoundMarkers(*lattice, count, expected_count(shape, pitch_px), fits)


def markers_finding(
    markers: FoundMarkers | None, parent: Profile, mm_per_px: float, name: str
) -> PictureFinding | None:
    """Return the finding for the profile; None if neither gel has markers."""
    if markers is not None:
        pitch_mm, diameter_mm = markers.pitch_px * mm_per_px, markers.diameter_px * mm_per_px
        unlike = parent.gel.markers is None
        doubt = f" {parent.name}'s gel has none." if unlike else ""
        if not markers.fits:
            doubt += (
                f" DOUBTFUL: about {markers.expected} would fill the image. Increase the diameter "
                f"until 'tactile run' reports most of them, or give a sharper image."
            )
        return PictureFinding(
            "gel",
            f"Pitch and diameter of the printed markers: {markers.pitch_px:.1f} and "
            f"{markers.diameter_px:.1f} px in {name}, with which {markers.count} are found.{doubt}",
            {
                "markers": {
                    "pitch_mm": float(f"{pitch_mm:.3g}"),
                    "diameter_mm": float(f"{diameter_mm:.2g}"),
                    "tone": markers.tone,
                }
            },
            noted=unlike or not markers.fits,
        )
    if parent.gel.markers is None:
        return None
    return PictureFinding(
        "gel",
        f"{name} shows no lattice of markers, although {parent.name}'s gel has one. If this gel "
        f"has markers, set {{pitch_mm: …, diameter_mm: …}}; otherwise they are measured as dents.",
        {"markers": None},
        noted=True,
    )
