"""Parameters of the marker detector."""

from __future__ import annotations


class DETECTION:
    """Parameters of marker detection. Nothing sets them from outside: they are relative.

    Lengths are relative to the marker's diameter, contrast and mass to the typical marker of the
    same frame. So they hold for any print, resolution and light.
    """

    smoothing_diameters = 1 / 3  # [marker diameters] Reach of the Gaussian kernel to either side
    # [marker diameters] Side of the opening that removes lines and grain, which are thinner than
    # markers.
    opening_diameters = 0.4
    # [marker diameters] Side of the square in which the peak contrast around a pixel is taken.
    # Source: as wide as the closing that estimates the background.
    peak_diameters = 2.2
    # [marker diameters] Width of the rim that contains the blurred edge of a marker.
    rim_diameters = 0.28
    # [px] Every how many pixels the typical contrast is sampled. Source: by hand, for speed.
    sample_step_px = 6
    # [share of the peak] Contrast above which a pixel belongs to the marker at the peak. Source:
    # chosen on a recording: 98.4 % of 123 markers stay found, 95.9 % at 0.5 (ADR 25).
    marker_share = 0.6
    # [share of the peak] Contrast that is subtracted before the moments are taken. Source: chosen
    # on a recording: with the rim, 0.27 px from the labels, 0.30 px without (ADR 25).
    background_share = 0.15
    # [share of the background] Share of the light that a marker absorbs at least, in any frame.
    min_marker_contrast = 0.08
    # [share of the typical contrast] Contrast above which a pixel may belong to a marker at all.
    min_contrast = 0.3
    # [share of the typical contrast] Peak of the faintest marker. Source: chosen on recorded
    # prints, whose faint markers have 0.35 (ADR 25).
    faintest_peak = 0.28
    # [share of the 5th percentile] Peak of the faintest marker relative to nearly the faintest of
    # the frame. An even print has no faint markers, so that faint spots in it are shading.
    faintest_peak_of_print = 0.45
    # [share of the markers] Percentile that represents the faintest marker of the frame. Source:
    # by hand, robust against a few outliers.
    faint_percentile = 0.05
    # [share] Spots below this share of the mass-weighted median are specks and do not count when
    # the typical marker is estimated.
    speck_mass = 0.2
    # [typical markers] Range of a marker's mass. Source: the lower end was chosen on recorded
    # prints, between the dirt, up to 0.31, and the smallest marker, 0.35 (ADR 25); the upper end
    # by hand, no script derives it.
    min_mass = 0.33
    max_mass = 9.0
    # [typical markers] Minimum mass in view of a marker that the border truncates.
    min_truncated_mass = 0.12
    # [typical markers] Minimum of mass times peak; a spot that is both faint and small is dirt.
    min_mass_times_peak = 0.11
    # [ratio] Maximum ratio of the standard deviations along the major and the minor axis.
    max_elongation = 2.4
    # [ratio] Minimum mass relative to that of a uniform ellipse with the same moments and peak.
    min_fill = 0.57
    # [standard deviations] Half the size of a marker. Source: between a disc, 2, and a square,
    # √3.
    half_size_sigmas = 1.85
    # [half sizes] Maximum standard deviation along the major axis of what the border leaves of a
    # marker.
    max_truncated_sigma = 0.7
    # [float), typical markers] Range of the mass of one piece of a marker that a highlight
    # splits.
    piece_mass = (0.12, 0.75)
    # [float), typical markers] Range of the mass of both pieces together. Source: by hand, around
    # 1.
    pieces_mass = (0.5, 1.35)
    # [half sizes] Maximum distance between the centroids of the two pieces. Source: by hand, the
    # pieces of one marker are at most one diameter apart.
    piece_distance = 1.5
    # [typical markers] Minimum mass of a bar, that is of markers that have merged. Source: by
    # hand, below the 2 of two markers.
    bar_mass = 1.6
    bar_sigma = 0.8  # [half sizes] Maximum standard deviation of a bar along its minor axis
    bar_peak = 0.75  # [typical markers] Minimum peak of a bar
    # [pitches] Deviation from the pitch that the markers of a bar may have.
    bar_pitch_tolerance = 0.4
