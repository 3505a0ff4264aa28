"""``core.contact_loss``: the strength of a contact by a marker lattice and the imprint."""

from __future__ import annotations

import numpy as np

from tactile_core.builtin.imprint_motion import LossOfContact
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import ContactLoss, ImprintMotion, MarkerField

LATTICE = np.stack(np.meshgrid(np.arange(10.0, 160, 15), np.arange(10.0, 120, 15)), -1)
LATTICE_PX = LATTICE.reshape(-1, 2).astype(np.float32)
CONTEXT = SensorContext(ImageSection(width_px=160, height_px=120, mm_per_px=0.1), Gel())


def markers(press: float, time_s: float, base: np.ndarray = LATTICE_PX) -> MarkerField:
    """Markers that a press in the middle pushes outwards, by shares of the pitch."""
    offset = base - np.array([80, 60], np.float32)
    near = np.exp(-np.square(offset).sum(axis=1, keepdims=True) / 400)
    px = (base + press * near * offset).astype(np.float32)
    ids = np.arange(len(base), dtype=np.int32)
    return MarkerField(px, ids, base, np.ones(len(base), np.bool_), 0.1, time_s)


def pressed_then(last: float) -> ContactLoss:
    step = LossOfContact(LossOfContact.Options(), CONTEXT)
    found = ContactLoss(False)
    for frame in range(60):
        press = 0.4 if frame < 40 else last
        strong = ImprintMotion(True, strength=0.08 if press else 0.0)
        found = step.estimate(markers(press, frame / 25), strong)
    return found


def test_a_contact_that_stays_loses_nothing() -> None:
    found = pressed_then(0.4)
    assert found.measured
    assert found.settled > 5
    assert found.lost < 0.1


def test_a_contact_that_leaves_is_lost() -> None:
    assert pressed_then(0.0).lost > 0.9


def test_scattered_markers_do_not_measure_it() -> None:
    scattered = np.random.default_rng(3).uniform(0, 120, (80, 2)).astype(np.float32)
    step = LossOfContact(LossOfContact.Options(), CONTEXT)
    found = step.estimate(markers(0.0, 0.0, scattered), ImprintMotion(True, strength=0.1))
    assert not found.measured


def test_it_is_not_measured_without_an_imprint() -> None:
    step = LossOfContact(LossOfContact.Options(), CONTEXT)
    assert not step.estimate(markers(0.4, 0.0), None).measured
