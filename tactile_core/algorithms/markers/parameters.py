"""Parameters of the marker detector."""

from __future__ import annotations

from typing import NamedTuple


class DetectionParameters(NamedTuple):
    """Parameters of marker detection. Nothing sets them from outside: they are relative.

    Lengths are relative to the marker's diameter, contrast and mass to the typical marker of the
    same frame. So they hold for any print, resolution and light.

    Attributes
    ----------
    smoothing_diameters : float, marker diameters
        Reach of the Gaussian kernel to either side.
        Source: chosen by hand; no script derives it.
    opening_diameters : float, marker diameters
        Side of the opening that removes lines and grain, which are thinner than markers.
        Source: chosen by hand; no script derives it.
    peak_diameters : float, marker diameters
        Side of the square in which the peak contrast around a pixel is taken.
        Source: as wide as the closing that estimates the background.
    rim_diameters : float, marker diameters
        Width of the rim that contains the blurred edge of a marker.
        Source: chosen by hand; no script derives it.
    sample_step_px : int, px
        Every how many pixels the typical contrast is sampled.
        Source: chosen by hand for speed; no script derives it.
    marker_share : float, share of the peak
        Contrast above which a pixel belongs to the marker at the peak.
        Source: chosen on a recording: 98.4 % of 123 markers stay found, 95.9 % at 0.5 (ADR 25).
    background_share : float, share of the peak
        Contrast that is subtracted before the moments are taken.
        Source: chosen on a recording: with the rim, 0.27 px from the labels, 0.30 px without
        (ADR 25).
    min_marker_contrast : float, share of the background
        Share of the light that a marker absorbs at least, in any frame.
        Source: chosen by hand; no script derives it.
    min_contrast : float, share of the typical contrast
        Contrast above which a pixel may belong to a marker at all.
        Source: chosen by hand; no script derives it.
    faintest_peak : float, share of the typical contrast
        Peak of the faintest marker.
        Source: chosen on recorded prints, whose faint markers have 0.35 (ADR 25).
    faintest_peak_of_print : float, share of the 5th percentile
        Peak of the faintest marker relative to nearly the faintest of the frame. An even print
        has no faint markers, so that faint spots in it are shading.
        Source: chosen by hand; no script derives it.
    faint_percentile : float, share of the markers
        Percentile that represents the faintest marker of the frame.
        Source: chosen by hand; robust against a few outliers.
    speck_mass : float, share
        Spots below this share of the mass-weighted median are specks and do not count when the
        typical marker is estimated.
        Source: chosen by hand; no script derives it.
    min_mass, max_mass : float, typical markers
        Range of a marker's mass.
        Source: the lower end was chosen on recorded prints, between the dirt, up to 0.31, and the
        smallest marker, 0.35 (ADR 25); the upper end by hand, no script derives it.
    min_truncated_mass : float, typical markers
        Minimum mass in view of a marker that the border truncates.
        Source: chosen by hand; no script derives it.
    min_mass_times_peak : float, typical markers
        Minimum of mass times peak; a spot that is both faint and small is dirt.
        Source: chosen by hand; no script derives it.
    max_elongation : float, ratio
        Maximum ratio of the standard deviations along the major and the minor axis.
        Source: chosen by hand; no script derives it.
    min_fill : float, ratio
        Minimum mass relative to that of a uniform ellipse with the same moments and peak.
        Source: chosen by hand; no script derives it.
    half_size_sigmas : float, standard deviations
        Half the size of a marker.
        Source: between a disc, 2, and a square, √3.
    max_truncated_sigma : float, half sizes
        Maximum standard deviation along the major axis of what the border leaves of a marker.
        Source: chosen by hand; no script derives it.
    piece_mass : (float, float), typical markers
        Range of the mass of one piece of a marker that a highlight splits.
        Source: chosen by hand; no script derives it.
    pieces_mass : (float, float), typical markers
        Range of the mass of both pieces together.
        Source: chosen by hand, around 1.
    piece_distance : float, half sizes
        Maximum distance between the centroids of the two pieces.
        Source: chosen by hand; the pieces of one marker are at most one diameter apart.
    bar_mass : float, typical markers
        Minimum mass of a bar, that is of markers that have merged.
        Source: chosen by hand, below the 2 of two markers.
    bar_sigma : float, half sizes
        Maximum standard deviation of a bar along its minor axis.
        Source: chosen by hand; no script derives it.
    bar_peak : float, typical markers
        Minimum peak of a bar.
        Source: chosen by hand; no script derives it.
    bar_pitch_tolerance : float, pitches
        Deviation from the pitch that the markers of a bar may have.
        Source: chosen by hand; no script derives it.
    """

    smoothing_diameters: float = 1 / 3
    opening_diameters: float = 0.4
    peak_diameters: float = 2.2
    rim_diameters: float = 0.28
    sample_step_px: int = 6
    marker_share: float = 0.6
    background_share: float = 0.15
    min_marker_contrast: float = 0.08
    min_contrast: float = 0.3
    faintest_peak: float = 0.28
    faintest_peak_of_print: float = 0.45
    faint_percentile: float = 0.05
    speck_mass: float = 0.2
    min_mass: float = 0.33
    max_mass: float = 9.0
    min_truncated_mass: float = 0.12
    min_mass_times_peak: float = 0.11
    max_elongation: float = 2.4
    min_fill: float = 0.57
    half_size_sigmas: float = 1.85
    max_truncated_sigma: float = 0.7
    piece_mass: tuple[float, float] = (0.12, 0.75)
    pieces_mass: tuple[float, float] = (0.5, 1.35)
    piece_distance: float = 1.5
    bar_mass: float = 1.6
    bar_sigma: float = 0.8
    bar_peak: float = 0.75
    bar_pitch_tolerance: float = 0.4


DETECTION = DetectionParameters()
"""The values in use."""
