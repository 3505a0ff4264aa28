"""Printed markers are detected at the size and pitch of the gel."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactile_core.conditioning.marker_finder import MarkerFinder
from tactile_core.errors import InputError
from tactile_core.interfaces.gel import Gel, Markers
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Frame, Reference

IMAGE = ImageSection(width_px=120, height_px=90, mm_per_px=0.05)
PRINTED = Gel(markers=Markers(pitch_mm=1.0, diameter_mm=0.4))


def test_a_gel_without_markers_needs_no_finder() -> None:
    assert MarkerFinder.for_gel(SimpleNamespace(gel=Gel(), image=IMAGE)) is None


def test_millimetres_of_the_gel_become_pixels_of_the_image() -> None:
    assert MarkerFinder.for_gel(SimpleNamespace(gel=PRINTED, image=IMAGE)) == MarkerFinder(
        "dark", 8.0, 20.0
    )


def test_markers_of_unknown_size_need_a_reference() -> None:
    with pytest.raises(InputError, match="--reference"):
        MarkerFinder.for_gel(SimpleNamespace(gel=Gel(markers="auto"), image=IMAGE))


def test_markers_of_the_other_tone_are_named_with_the_key_to_correct() -> None:
    y, x = np.mgrid[:90, :120]
    white = np.where(np.hypot((x % 20) - 10, (y % 20) - 10) <= 4, 200, 90).astype(np.uint8)
    reference = Reference(white[..., np.newaxis].repeat(3, 2), ("red", "green", "blue"), 255)
    said = MarkerFinder("dark", 8.0, 20.0).explain_miscount(reference)
    assert "it has 30 bright ones of" in said
    assert "(its tone first)" in said
    assert MarkerFinder("bright", 8.0, 20.0).explain_miscount(reference) == ""
    assert MarkerFinder.for_gel(SimpleNamespace(gel=Gel(markers="auto"), image=IMAGE), reference)


def test_the_mask_covers_the_markers_and_little_else() -> None:
    y, x = np.mgrid[:90, :120]
    printed = np.hypot((x % 20) - 10, (y % 20) - 10) <= 4
    pixels = np.where(printed, 40, 160).astype(np.uint8)[..., np.newaxis].repeat(3, 2)
    found = MarkerFinder("dark", 8.0, 20.0)
    marked = found.mask_frame(Frame(pixels, ("red", "green", "blue"), IMAGE.mm_per_px))
    assert marked.marker_mask is not None
    assert marked.marker_mask[printed].all()
    assert marked.marker_mask.mean() < 2 * printed.mean()
    whole = ~found.detect(marked).truncated
    assert np.count_nonzero(whole) == 4 * 6


def test_markers_that_fill_part_of_the_view_are_counted() -> None:
    y, x = np.mgrid[:90, :120]
    dots = np.hypot((x % 20) - 10, (y % 20) - 10) <= 4
    white = np.where(dots & (x < 60) & (y < 60), 200, 90).astype(np.uint8)
    reference = Reference(white[..., np.newaxis], ("white",), 255)
    few = Gel(markers=Markers(pitch_mm=1.0, diameter_mm=0.4, tone="bright", count=9))
    finder = MarkerFinder.for_gel(SimpleNamespace(gel=few, image=IMAGE))
    assert finder is not None
    assert finder.explain_miscount(reference) == ""
    assert finder.with_markers(few, IMAGE.mm_per_px).markers == few.markers
    said = MarkerFinder("bright", 8.0, 20.0, count=24).explain_miscount(reference)
    assert said.startswith("the reference shows 9 bright markers, and the profile says 24")
    assert MarkerFinder("bright", 8.0, 20.0).explain_miscount(reference) != ""
