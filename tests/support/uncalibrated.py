"""Uncalibrated units: what a design's starting calibration measures of balls pressed on them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.bundles.bundle import Bundle
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import ContactMask, HeightMap
from tactile_sim.simulation import ball_diameter_mm, put_object
from tactile_sim.stage import VirtualStage, vary


def assert_coarse(name: str | Path, bundle: Bundle | None = None, *, within: float = 0.25) -> None:
    """Check that contacts of unseen virtual units are found, and depths within a share, mostly.

    Parameters
    ----------
    name : str or Path
        A profile.
    bundle : Bundle, optional
        Default: the starting calibration that the profile names.
    within : float
        Of nine in ten presses.
    """
    start = load_profile(name).starting_bundle
    if bundle is None:
        assert start is not None
        bundle = Bundle.load(start)
    found = _virtual_presses(load_profile(name, sim=True), bundle, range(101, 104))
    depths, contacts = map(np.array, zip(*found, strict=True))
    assert contacts.mean() >= 0.95
    assert np.mean(np.abs(depths - 1) < within) >= 0.9


def _virtual_presses(design: Profile, bundle: Bundle, units: range) -> Iterator[tuple[float, bool]]:
    """Yield of each press the measured over the true depth, and whether its contact is found.

    Each virtual unit is pressed four times.
    """
    for number in units:
        unit = vary(design, number)
        stage = VirtualStage(unit, number)
        pipeline = Pipeline(unit, bundle, average([stage.frame()]))
        rng, usual_mm = np.random.default_rng(number), ball_diameter_mm(unit)
        for _ in range(4):
            x, y = rng.uniform(-0.3, 0.3, 2)
            ball_mm = float(rng.uniform(0.7, 1.3)) * usual_mm
            put_object(stage, "sphere", float(x), float(y), diameter_mm=ball_mm)
            stage.press(depth_mm=float(rng.uniform(0.1, 0.2)) * ball_mm)
            truth, reading = stage.truth(), pipeline.process(stage.frame())
            found = reading[ContactMask].mask & truth.contact
            yield (
                float(reading[HeightMap].mm.max() / truth.height_mm.max()),
                bool(found.sum() > truth.contact.sum() / 2),
            )
