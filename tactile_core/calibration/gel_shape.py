"""The shape of the gel that a ball is pressed into, in the units of the image."""

from __future__ import annotations

from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.profiles.model import Profile


def thickness_of(profile: Profile) -> float:
    """Return the thickness of the gel in mm, the usual one if the profile gives none."""
    return THICKNESS_MM if profile.gel.thickness_mm is None else profile.gel.thickness_mm


def dome_radius_px(profile: Profile) -> float | None:
    """Return the radius of an undeformed domed gel in px; None for a flat one."""
    radius_mm = profile.gel.radius_mm
    return None if radius_mm is None else radius_mm / profile.image.mm_per_px
