"""Intensity levels that several modules share, as shares of the full scale."""

from __future__ import annotations


class LEVELS:
    """Levels between which an intensity measures light.

    Nothing sets them from outside. A calibration is fitted with these levels and stored without
    them, so a bundle is measured correctly only if they stay the same.
    """

    # [grey levels] Intensity at which an 8-bit channel saturates; the default full scale. Source:
    # the largest unsigned byte, 2⁸ − 1.
    full_scale_8_bit = 255.0
    # [share of the full scale] From this intensity on a channel is saturated: it shows a lower
    # bound of the light. Source: by hand, (252 of 255).
    saturation_share = 0.988
    # [share of the full scale] Up to this intensity a channel is too dark to measure. Source: by
    # hand, (3 of 255).
    dark_share = 0.012
    # [share of the full scale] Reference intensities are raised to this before a frame is divided
    # by them, so that a grey level of noise in the dark is no large relative change. Source: by
    # hand, (10 of 255).
    least_divisor_share = 0.04
