"""Which intensities measure light, as shares of the full scale."""

CEILING = 0.988
"""From here on an intensity is saturated: the light is at least this, and may be any more."""

FLOOR = 0.012
"""Up to here an intensity is too dark to measure."""
