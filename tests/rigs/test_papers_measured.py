"""Observations of Yuan et al. (ICRA 2015, Sensors 2017), reproduced on virtual rigs.

Each frame is rendered, and measured by the complete pipeline with a calibration of the rig.
``plugins/tactile-sim/tests/test_papers.py`` tests the mechanics of the gel without rendering.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core import ContactMask, DisplacementField, MarkerField, SlipState, load_profile
from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.displacement.decomposition import decompose_field
from tactile_core.calibration.virtual_unit import virtual_unit
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_sim import VirtualStage

pytestmark = pytest.mark.headline

Array = NDArray[np.float32]
Bool = NDArray[np.bool_]

RIGS = ("hex_fingertip", "baxter_fingertip_marked")
STEP_MM = 0.05
PRESSES: dict[str, tuple[dict[str, Any], float]] = {
    # larger than the gel, "in full contact with the sensor"
    "plate": ({"kind": "flat", "size_mm": (40.0, 40.0)}, 45.0),
    # all of its contact is in view
    "disc": ({"kind": "flat", "diameter_mm": 9.0}, 8.0),
    # moved along its length, like a can that is lifted
    "can": ({"kind": "cylinder", "diameter_mm": 38.08, "angle_deg": 90.0}, 18.0),
}


class Rig:
    """A calibrated virtual rig: a stage that moves objects, and a pipeline for its frames."""

    def __init__(self, name: str) -> None:
        profile = load_profile(name, sim=True)
        bundle = virtual_unit(profile, model="core.lookup_table").bundle
        self.stage = VirtualStage(profile)
        self.pipeline = Pipeline(profile, bundle, average([self.stage.frame()]))
        self.mm_per_px = profile.image.mm_per_px
        self.shape = profile.image.height_px, profile.image.width_px

    def look(self, *, tare: bool = False) -> Reading:
        return self.pipeline.process(self.stage.frame(), tare=tare)

    def press(self, force_n: float, **indenter: Any) -> Reading:
        """Press an object on the undeformed gel."""
        self.stage.reset()
        self.pipeline.reset()
        self.look()
        self.stage.indenter(**indenter)
        for share in (0.25, 0.5, 0.75, 1.0):
            self.stage.press(force_n=share * force_n)
            reading = self.look()
        return reading

    def press_and_tare(self, kind: str) -> Reading:
        """Press one of :data:`PRESSES`; "subtract the field of the normal load" [Yuan 2015]."""
        indenter, force_n = PRESSES[kind]
        self.press(force_n, **indenter)
        return self.look(tare=True)

    @property
    def shear_force_n(self) -> float:
        return float(self.stage.truth().wrench[1])

    def places_mm(self) -> tuple[Array, Array]:
        """x and y of the pixels, from the image centre."""
        y, x = np.indices(self.shape, np.float32)
        middle_y, middle_x = ((side - 1) / 2 for side in self.shape)
        return self.mm_per_px * (x - middle_x), self.mm_per_px * (y - middle_y)


@pytest.fixture(scope="session")
def rig(rigs: Callable[[str], Rig]) -> Rig:
    return rigs("hex_fingertip")


@pytest.fixture(scope="session")
def rigs() -> Callable[[str], Rig]:
    """Each rig is calibrated once."""
    made: dict[str, Rig] = {}

    def one(name: str) -> Rig:
        if name not in made:
            made[name] = Rig(name)
        return made[name]

    return one


@dataclass(frozen=True)
class Sheared:
    """An object that is pressed and then moved along y in steps.

    Attributes
    ----------
    moved_mm, force_n : (N,)
        Displacement of the object since the press and shear force, by step.
    mean_mm, whole_mm, largest_mm, entropy_bits, lagging : (N,)
        Measured mean displacement over the contact and over the image, its maximum, its entropy,
        and the share of the contact that lags behind the object, by step.
    field_mm : list of (H, W)
        Displacement along y.
    contact : list of (H, W) bool
    states : list of str
    """

    moved_mm: NDArray[np.float64]
    force_n: NDArray[np.float64]
    mean_mm: NDArray[np.float64]
    whole_mm: NDArray[np.float64]
    largest_mm: NDArray[np.float64]
    entropy_bits: NDArray[np.float64]
    lagging: NDArray[np.float64]
    field_mm: list[Array]
    contact: list[Bool]
    states: list[str]

    def at(self, moved_mm: float) -> int:
        """Index of the step at which the object had moved so far."""
        return int(np.argmin(np.abs(self.moved_mm - moved_mm)))


BEHIND_MM = 0.02
"""Five times the error of the displacement in stick regions due to noise and interpolation."""


@pytest.fixture(scope="session")
def shear(rigs: Callable[[str], Rig]) -> Callable[[str, str], Sheared]:
    """Each object is sheared once on each rig."""
    done: dict[tuple[str, str], Sheared] = {}

    def sheared(kind: str, name: str = "hex_fingertip") -> Sheared:
        if (kind, name) not in done:
            done[kind, name] = _shear(rigs(name), kind)
        return done[kind, name]

    return sheared


def _shear(rig: Rig, kind: str) -> Sheared:
    rig.press_and_tare(kind)
    rows, fields, contacts, states = [], [], [], list[str]()
    for moved in STEP_MM * np.arange(1, 17):
        rig.stage.shear(dy_mm=STEP_MM)
        reading = rig.look()
        mm, slip = reading[DisplacementField].mm, reading[SlipState]
        # the border of a plate larger than the view is not visible
        contact = np.ones(rig.shape, np.bool_) if kind == "plate" else reading[ContactMask].mask
        along = mm[..., 1]
        rows.append(
            (
                moved,
                rig.shear_force_n,
                along[contact].mean(),
                along.mean(),
                np.hypot(*mm[contact].T).max(),
                slip.entropy_bits or 0.0,
                np.mean(moved - along[contact] > BEHIND_MM),
            )
        )
        fields.append(along)
        contacts.append(contact)
        states.append(slip.state)
    moved_mm, force_n, mean_mm, whole_mm, largest_mm, entropy_bits, lagging = np.array(rows).T
    return Sheared(
        moved_mm,
        force_n,
        mean_mm,
        whole_mm,
        largest_mm,
        entropy_bits,
        lagging,
        fields,
        contacts,
        states,
    )


def _r2_of_proportion(force: NDArray[np.float64], mean: NDArray[np.float64]) -> float:
    slope = (force * mean).sum() / (mean**2).sum()
    return float(1 - ((force - slope * mean) ** 2).sum() / ((force - force.mean()) ** 2).sum())


Shear = Callable[..., Sheared]


@pytest.mark.parametrize("name", RIGS)
def test_shear_of_a_flat_indenter_is_linear_then_sublinear_then_constant(
    shear: Shear, name: str
) -> None:
    plate = shear("plate", name)
    early = plate.moved_mm < 0.21
    np.testing.assert_allclose(plate.mean_mm[early], plate.moved_mm[early], rtol=0.02)
    stiffness = np.diff(plate.mean_mm) / STEP_MM
    middle, late = plate.at(0.55), plate.at(0.75)
    assert 0.2 < stiffness[middle] < 0.8
    assert abs(stiffness[late]) < 0.12


def test_a_flat_indenter_is_warned_of_from_0_6_mm_on_where_it_slips_partially(shear: Shear) -> None:
    plate = shear("plate")
    assert set(plate.states[: plate.at(0.4)]) == {"stick"}
    assert plate.states[plate.at(0.6)] == "incipient"
    # under a plate wider than the view, the field alone does not show that the last of it slips
    assert set(plate.states[plate.at(0.7) :]) <= {"incipient", "slip"}


@pytest.mark.parametrize("name", RIGS)
def test_mean_displacement_under_a_plate_is_proportional_to_the_force(
    shear: Shear, name: str
) -> None:
    plate = shear("plate", name)
    assert _r2_of_proportion(plate.force_n, plate.mean_mm) > 0.99


@pytest.mark.parametrize("kind", ["disc", "can"])
def test_mean_displacement_in_a_measured_contact_is_proportional_to_the_force(
    shear: Shear, kind: str
) -> None:
    sheared = shear(kind)
    assert _r2_of_proportion(sheared.force_n, sheared.mean_mm) > 0.99


def test_mean_displacement_of_the_entire_gel_under_a_disc_is_proportional_to_the_force(
    shear: Shear,
) -> None:
    disc = shear("disc")
    assert _r2_of_proportion(disc.force_n, disc.mean_mm) > 0.998
    assert _r2_of_proportion(disc.force_n, disc.whole_mm) > 0.999


def test_largest_displacement_follows_the_object_to_0_6_mm_and_then_stays_or_falls(
    shear: Shear,
) -> None:
    plate = shear("plate")
    early = plate.moved_mm < 0.61
    np.testing.assert_allclose(plate.largest_mm[early], plate.moved_mm[early], atol=0.035)
    late = plate.largest_mm[plate.at(0.7) :]
    assert late.max() < 0.68
    assert late[-1] <= late[0] + 0.01


def test_partial_slip_starts_at_the_border_and_moves_inwards(shear: Shear) -> None:
    can = shear("can")
    depths = []
    for moved in (0.5, 0.6, 0.7):
        step = can.at(moved)
        inside = _distance_to_border(can.contact[step])
        slips = can.contact[step] & (moved - can.field_mm[step] > BEHIND_MM)
        assert inside[can.contact[step] & ~slips].mean() > 2 * inside[slips].mean()
        depths.append(inside[slips].mean())
    assert depths == sorted(depths)


def _distance_to_border(mask: Bool) -> NDArray[np.float64]:
    from scipy.ndimage import distance_transform_edt

    # the border of the view is no border of the contact
    return np.asarray(distance_transform_edt(np.pad(mask, 1, mode="edge"))[1:-1, 1:-1])


def test_a_cylinder_slips_earlier_and_over_a_wider_range_than_a_plate(shear: Shear) -> None:
    def band(of: Sheared) -> tuple[float, float]:
        partly = of.moved_mm[(of.lagging > 0.05) & (of.lagging < 0.98)]
        return float(partly.min()), float(np.ptp(partly))

    (first, width), (plate_first, plate_width) = band(shear("can")), band(shear("plate"))
    assert first < plate_first - 0.04
    assert width > plate_width + 0.2


@pytest.mark.parametrize("name", RIGS)
def test_entropy_rises_with_partial_slip_into_the_incipient_band_of_a_plate(
    shear: Shear, name: str
) -> None:
    plate = shear("plate", name)
    assert plate.entropy_bits[plate.at(0.3)] < 2.0
    assert plate.entropy_bits[plate.at(0.5)] < 4.5
    partly = (plate.lagging > 0.55) & (plate.lagging < 0.98)
    assert partly.any()
    assert ((plate.entropy_bits[partly] > 4.5) & (plate.entropy_bits[partly] < 6.0)).all()


def test_entropy_of_a_cylinder_is_4_to_6_5_in_partial_slip(shear: Shear) -> None:
    can = shear("can")
    partial = can.lagging > 0.4
    assert partial.sum() >= 3
    assert ((can.entropy_bits[partial] > 4.0) & (can.entropy_bits[partial] < 6.5)).all()


@pytest.fixture(scope="session")
def turned(rig: Rig) -> dict[float, Reading]:
    """Readings by angle of the plate."""
    rig.press_and_tare("plate")
    found, before = {}, 0.0
    for angle in (0.6, 1.5, 3.0, 4.5):
        rig.stage.twist(angle - before, steps=3)
        found[angle] = rig.look()
        before = angle
    return found


def _turn_deg(rig: Rig, reading: Reading, ring: Bool) -> float:
    field = reading[DisplacementField]
    return decompose_field(field.mm, ring, mm_per_px=rig.mm_per_px).rotation_deg


def test_a_rotation_of_0_6_degrees_is_homogeneous(rig: Rig, turned: dict[float, Reading]) -> None:
    r = np.hypot(*rig.places_mm())
    for ring in (r < 3, (r > 3) & (r < 6), r > 8):
        assert _turn_deg(rig, turned[0.6], ring) == pytest.approx(0.6, rel=0.06)


def test_at_4_5_degrees_the_outer_markers_rotate_less(
    rig: Rig, turned: dict[float, Reading]
) -> None:
    r = np.hypot(*rig.places_mm())
    assert _turn_deg(rig, turned[4.5], r < 3) == pytest.approx(4.5, rel=0.03)
    assert _turn_deg(rig, turned[4.5], r > 8) < 3.8


def test_the_field_of_a_rotation_is_a_spiral(rig: Rig, turned: dict[float, Reading]) -> None:
    x, y = rig.places_mm()
    u, v = np.moveaxis(turned[3.0][DisplacementField].mm, 2, 0)
    far = np.hypot(x, y) > 2
    around, outwards = (x * v - y * u)[far], (x * u + y * v)[far]
    assert (around > 0).all()
    assert np.abs(outwards).mean() < 0.1 * around.mean()


def _step_in_shear(rig: Rig, before_mm: float, step_mm: float) -> list[Array]:
    """Fields along y before, right after, 10 s, 3 min and 10 min after a step."""
    rig.press_and_tare("plate")
    # the markers of a regular lattice look alike: they are tracked in steps below one pitch
    for _ in range(4):
        rig.stage.shear(dy_mm=before_mm / 4, steps=2)
        before = rig.look()
    fields = [before[DisplacementField].mm[..., 1]]
    for _ in range(4):
        rig.stage.shear(dy_mm=step_mm / 4, seconds=0.1)
        rig.look()
    for seconds in (0.0, 10.0, 170.0, 420.0):
        rig.stage.hold(seconds)
        fields.append(rig.look()[DisplacementField].mm[..., 1])
    return fields


def test_after_a_step_the_border_slips_back_while_the_centre_stays(rig: Rig) -> None:
    fields = _step_in_shear(rig, 0.45, 0.1)
    jump, back, slow, last = (later - earlier for earlier, later in itertools.pairwise(fields))
    x, y = rig.places_mm()
    centre = np.hypot(x, y) < 1
    assert jump.mean() > 0.09
    assert jump.std() < 0.15 * jump.mean()
    assert back[centre].mean() == pytest.approx(0, abs=0.004)
    assert back.min() < -0.04
    for later in (slow, last):
        assert np.abs(later).max() < 0.15 * np.abs(back).max()


def test_a_small_step_causes_no_slip(rig: Rig) -> None:
    fields = _step_in_shear(rig, 0.15, 0.05)
    np.testing.assert_allclose(fields[-1] - fields[0], 0.05, atol=0.008)


def test_a_large_step_ends_near_the_displacement_before_it(rig: Rig) -> None:
    """The mean displacement is proportional to the force, which thus ends near the prior one."""
    before, *_, after = (field.mean() for field in _step_in_shear(rig, 0.6, 0.5))
    assert after == pytest.approx(before, rel=0.06)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("flat", {"diameter_mm": 12.5}),
        ("cylinder", {"diameter_mm": 38.08}),
        ("sphere", {"diameter_mm": 25.0}),
    ],
)
def test_markers_spread_outwards_under_a_normal_load(
    rig: Rig, kind: str, options: dict[str, float]
) -> None:
    markers = rig.press(4.0, kind=kind, **options)[MarkerField]
    middle_px = (np.array(rig.shape[::-1]) - 1) / 2
    at, moved = (
        (markers.reference_px - middle_px)[markers.seen],
        markers.displacement_mm[markers.seen],
    )
    size = np.hypot(*moved.T)
    far = size > 0.3 * size.max()
    assert size.max() > 0.02
    assert ((moved * at).sum(1)[far] > 0).all()
    np.testing.assert_allclose(moved.mean(0), 0, atol=1e-3)
