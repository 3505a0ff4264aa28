"""Intensity levels that several modules share, as shares of the full scale."""

from __future__ import annotations

from typing import NamedTuple


class LevelParameters(NamedTuple):
    """Levels between which an intensity measures light.

    Nothing sets them from outside. A calibration is fitted with these levels and stored without
    them, so a bundle is measured correctly only if they stay the same.

    Attributes
    ----------
    full_scale_8_bit : float, grey levels
        Intensity at which an 8-bit channel saturates; the default full scale.
        Source: the largest unsigned byte, 2⁸ − 1.
    saturation_share : float, share of the full scale
        From this intensity on a channel is saturated: it shows a lower bound of the light.
        Source: chosen by hand (252 of 255); no script derives it.
    dark_share : float, share of the full scale
        Up to this intensity a channel is too dark to measure.
        Source: chosen by hand (3 of 255); no script derives it.
    least_divisor_share : float, share of the full scale
        Reference intensities are raised to this before a frame is divided by them, so that a
        grey level of noise in the dark is no large relative change.
        Source: chosen by hand (10 of 255); no script derives it.
    """

    full_scale_8_bit: float = 255.0
    saturation_share: float = 0.988
    dark_share: float = 0.012
    least_divisor_share: float = 0.04


LEVELS = LevelParameters()
"""The values in use."""
