"""The annotations of estimate() are the wiring of the chain."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import pytest
from pydantic import BaseModel

from tactile_core.errors import InputError, PluginError, ProfileError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator, External, SensorContext
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.pipeline.chain import Chain, declared_step, without_markers
from tactile_core.quantities import (
    ContactMask,
    Frame,
    Gradients,
    HeightMap,
    Quantity,
    Reference,
)

if TYPE_CHECKING:
    from decimal import Decimal as OnlyForTheTypeChecker

CONTEXT = SensorContext(ImageSection(width_px=4, height_px=3, mm_per_px=0.1), Gel())
ZEROS = np.zeros((3, 4), np.float32)
EVERYWHERE = np.ones((3, 4), np.bool_)
FRAME = Frame(np.zeros((3, 4, 3), np.uint8), ("r", "g", "b"), 0.1)
REFERENCE = Reference(np.zeros((3, 4, 3), np.float32), ("r", "g", "b"))
GRADIENTS = Gradients(ZEROS, ZEROS, EVERYWHERE, 0.1)
HEIGHT = HeightMap(ZEROS, EVERYWHERE, 0.1)


@dataclass(frozen=True, eq=False)
class Area(Quantity):
    mm2: float


@dataclass(frozen=True, eq=False)
class Brightness(Quantity):
    change: float | None


class Height(Estimator):
    def estimate(self, gradients: Gradients) -> HeightMap:
        return HeightMap(gradients.x + 1, gradients.valid, gradients.mm_per_px)


class OtherHeight(Height):
    pass


class Contact(Estimator):
    def estimate(self, height: HeightMap, frame: Frame) -> ContactMask:
        return ContactMask(height.mm > 0.5, frame.mm_per_px)


class Measure(Estimator):
    def estimate(self, contact: ContactMask) -> Area:
        return Area(contact.area_mm2)


class Glow(Estimator):
    def estimate(self, frame: Frame, reference: Reference | None) -> Brightness:
        if reference is None:
            return Brightness(None)
        return Brightness(float(frame.pixels.mean() - reference.pixels.mean()))


class OldStyleGlow(Estimator):
    def estimate(self, frame: Frame, reference: Optional[Reference] = None) -> Brightness:  # noqa: UP045
        return Brightness(None if reference is None else 1.0)


class Counter(Estimator):
    stateful = True

    def __init__(self, options: Any, context: SensorContext) -> None:
        super().__init__(options, context)
        self.seen = 0

    def estimate(self, frame: Frame) -> Area:
        self.seen += 1
        return Area(float(self.seen))

    def reset(self) -> None:
        self.seen = 0


class Stumbling(Estimator):
    def estimate(self, frame: Frame) -> Area:
        raise InputError("the frame is upside down")


class Lying(Estimator):
    def estimate(self, frame: Frame) -> Area:
        return HEIGHT  # type: ignore[return-value]


class Circular(Estimator):
    def estimate(self, area: Area) -> Area:
        return area


class NoMethod(Estimator):
    pass


class NoArgumentAnnotation(Estimator):
    def estimate(self, frame) -> Area:  # type: ignore[no-untyped-def]
        return Area(0)


class NoReturnAnnotation(Estimator):
    def estimate(self, frame: Frame):  # type: ignore[no-untyped-def]
        return Area(0)


class NotAQuantity(Estimator):
    def estimate(self, frame: Frame) -> float:
        return 0.0


class OneOfTwo(Estimator):
    def estimate(self, measured: Gradients | HeightMap) -> Area:
        return Area(0)


class MaybeNothing(Estimator):
    def estimate(self, frame: Frame) -> Area | None:
        return None


class Anything(Estimator):
    def estimate(self, *quantities: Frame) -> Area:
        return Area(0)


class Unresolvable(Estimator):
    def estimate(self, number: OnlyForTheTypeChecker) -> Area:
        return Area(0)


def chain(**steps: type[Estimator]) -> Chain:
    return Chain({name: cls(Options(), CONTEXT) for name, cls in steps.items()})


def everything() -> dict[type[Quantity], Quantity]:
    return {Frame: FRAME, Reference: REFERENCE, Gradients: GRADIENTS}


def test_each_step_gets_what_its_annotations_ask_for() -> None:
    result = chain(height=Height, contact=Contact, area=Measure).run(everything())
    assert isinstance(result.steps["height"], HeightMap)
    assert result.by_type[HeightMap] is result.steps["height"]
    assert result.by_type[Gradients] is GRADIENTS
    area = result.by_type[Area]
    assert isinstance(area, Area)
    assert area.mm2 == pytest.approx(12 * 0.01)
    assert list(result.steps) == ["height", "contact", "area"]
    assert result.left_out == {}


def test_the_given_quantities_are_not_touched() -> None:
    given = everything()
    chain(height=Height).run(given)
    assert given == everything()


def test_an_empty_chain_gives_what_it_was_given() -> None:
    assert chain().run(everything()).by_type == everything()


@pytest.mark.parametrize("cls", [Glow, OldStyleGlow])
def test_an_optional_input_may_be_missing(cls: type[Estimator]) -> None:
    glow = chain(glow=cls)
    without = glow.run({Frame: FRAME}).by_type[Brightness]
    with_it = glow.run({Frame: FRAME, Reference: REFERENCE}).by_type[Brightness]
    assert isinstance(without, Brightness)
    assert isinstance(with_it, Brightness)
    assert without.change is None
    assert with_it.change is not None


def test_a_step_without_its_input_is_left_out_with_all_that_depend_on_it() -> None:
    steps = chain(height=Height, contact=Contact, area=Measure, glow=Glow)
    missing = {"height": Gradients, "contact": HeightMap, "area": ContactMask}
    assert steps.left_out({Frame}) == missing
    result = steps.run({Frame: FRAME})
    assert result.left_out == missing
    assert list(result.steps) == ["glow"]


def test_what_is_foretold_is_what_happens() -> None:
    steps = chain(height=Height, contact=Contact, area=Measure, glow=Glow)
    given = everything()
    for kinds in ([], [Frame], [Gradients], [Frame, Gradients], list(given)):
        result = steps.run({kind: given[kind] for kind in kinds})
        assert result.left_out == steps.left_out(kinds)


def test_a_sensor_that_measures_height_directly_leaves_integration_out() -> None:
    result = chain(height=Height, contact=Contact).run({Frame: FRAME, HeightMap: HEIGHT})
    assert result.by_type[HeightMap] is HEIGHT
    assert set(result.left_out) == {"height"}
    assert "contact" in result.steps


def test_giving_what_the_sensor_gave_already_is_an_error() -> None:
    with pytest.raises(ProfileError, match=r"'height' .* provides HeightMap"):
        chain(height=Height).run({**everything(), HeightMap: HEIGHT})


def test_two_producers_of_one_quantity_are_both_named() -> None:
    with pytest.raises(ProfileError) as caught:
        chain(height=Height, better=OtherHeight)
    message = str(caught.value)
    assert "'height' (Height)" in message
    assert "'better' (OtherHeight)" in message
    assert "HeightMap" in message


def test_every_wrong_order_is_refused_and_says_what_to_move() -> None:
    right: dict[str, type[Estimator]] = {"height": Height, "contact": Contact, "area": Measure}
    for order in permutations(right):
        if list(order) == list(right):
            continue
        with pytest.raises(ProfileError, match=r"move '(height|contact)' before"):
            chain(**{name: right[name] for name in order})


def test_a_step_that_feeds_on_itself_is_refused() -> None:
    with pytest.raises(ProfileError, match=r"'area' .* provides itself"):
        chain(area=Circular)


def test_a_step_that_could_never_run_is_refused_by_the_check() -> None:
    steps = chain(contact=Contact)
    steps.check({Frame, HeightMap})
    with pytest.raises(ProfileError, match=r"'contact' \(Contact\) needs HeightMap"):
        steps.check({Frame, Reference, Gradients})


@pytest.mark.parametrize(
    ("cls", "fault"),
    [
        (NoMethod, r"does not define estimate\(\)"),
        (NoArgumentAnnotation, "'frame' .* has no annotation"),
        (NoReturnAnnotation, "the result .* has no annotation"),
        (NotAQuantity, "the result .* float"),
        (OneOfTwo, "'measured' .* one Quantity type"),
        (MaybeNothing, "never None"),
        (Anything, "plain arguments"),
        (Unresolvable, "OnlyForTheTypeChecker.*TYPE_CHECKING"),
    ],
)
def test_an_unclear_declaration_is_refused_by_step_and_class(
    cls: type[Estimator], fault: str
) -> None:
    with pytest.raises(PluginError, match=fault) as caught:
        chain(mystery=cls)
    assert f"'mystery' ({cls.__name__})" in str(caught.value)


def test_a_step_that_raises_is_let_through_with_its_name() -> None:
    with pytest.raises(InputError, match="upside down") as caught:
        chain(look=Stumbling).run(everything())
    assert caught.value.__notes__ == [f"raised by step 'look' ({__name__}.Stumbling)"]


def test_a_step_that_gives_something_else_than_it_declares_is_caught() -> None:
    with pytest.raises(PluginError, match=r"'area' .* returned HeightMap instead of the Area"):
        chain(area=Lying).run(everything())


def test_a_declaration_tells_arguments_needs_and_result() -> None:
    step = declared_step("glow", Glow(Options(), CONTEXT))
    assert step.takes == (Frame, Reference)
    assert step.needs == (Frame,)
    assert step.gives == (Brightness,)


def test_reset_reaches_every_step() -> None:
    steps = chain(count=Counter)
    counts = [steps.run(everything()).by_type[Area] for _ in range(3)]
    steps.reset()
    again = steps.run(everything()).by_type[Area]
    assert [c.mm2 for c in counts if isinstance(c, Area)] == [1, 2, 3]
    assert isinstance(again, Area)
    assert again.mm2 == 1


def test_one_stateful_step_makes_the_chain_stateful() -> None:
    assert chain(height=Height, count=Counter).stateful
    assert not chain(height=Height).stateful


def test_a_chain_pickles_with_what_it_has_seen() -> None:
    steps = chain(height=Height, count=Counter)
    steps.run(everything())
    copy = pickle.loads(pickle.dumps(steps))
    assert copy.run(everything()).by_type[Area].mm2 == 2


@dataclass(frozen=True, eq=False)
class Load(Quantity):
    newtons: float


class Scale(Estimator):
    """Tells the frame's exposure time as a load."""

    needs_markers = True
    zero = last = 0.0
    estimated = 0

    def estimate(self, frame: Frame) -> Load:
        self.estimated += 1
        self.last = frame.timestamp_s
        return Load(self.last - self.zero)

    def tare(self, result: Load) -> Load:
        self.zero = self.last
        return Load(0.0)

    def reset(self) -> None:
        self.zero = self.last = 0.0


class Heavy(Estimator):
    def estimate(self, load: Load) -> Area:
        return Area(2 * load.newtons)


def weighed(chain: Chain, time_s: float, *, tare: bool = False) -> float:
    frame = Frame(FRAME.pixels, FRAME.channels, 0.1, timestamp_s=time_s)
    area = chain.run({Frame: frame}, tare=tare).by_type[Area]
    assert isinstance(area, Area)
    return area.mm2


def test_a_tare_subtracts_that_frames_load_until_reset() -> None:
    chain = Chain({"scale": Scale(Options(), CONTEXT), "heavy": Heavy(Options(), CONTEXT)})
    assert weighed(chain, 3.0, tare=True) == 0.0
    assert weighed(chain, 4.0) == 2.0
    chain.reset()
    assert weighed(chain, 4.0) == 8.0


def test_a_frame_that_is_tared_reads_zero_itself_in_all_steps() -> None:
    chain = Chain({"scale": Scale(Options(), CONTEXT), "heavy": Heavy(Options(), CONTEXT)})
    assert weighed(chain, 5.0, tare=True) == 0.0
    assert weighed(chain, 6.0) == 2.0


def test_a_frame_that_is_tared_is_estimated_once() -> None:
    scale = Scale(Options(), CONTEXT)
    weighed(Chain({"scale": scale, "heavy": Heavy(Options(), CONTEXT)}), 5.0, tare=True)
    assert scale.estimated == 1


def test_what_a_step_returns_of_a_tare_is_checked() -> None:
    class Silent(Scale):
        def tare(self, result: Load) -> Load:
            return None  # type: ignore[return-value]

    steps = {"scale": Silent(Options(), CONTEXT), "heavy": Heavy(Options(), CONTEXT)}
    with pytest.raises(PluginError, match=r"'scale' .* returned NoneType instead of the Load"):
        weighed(Chain(steps), 5.0, tare=True)


def test_steps_that_live_on_markers_go_with_those_that_need_them() -> None:
    steps = {"scale": Scale(Options(), CONTEXT), "heavy": Heavy(Options(), CONTEXT)}
    assert without_markers(steps) == ["scale", "heavy"]
    assert without_markers({"height": Height(Options(), CONTEXT)}) == []


@dataclass(frozen=True, eq=False)
class RobotPose(Quantity):
    x_mm: float


class Split(Estimator):
    """Gives two quantities, and holds a session while it is open."""

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self.done: list[str] = []

    def open(self) -> None:
        self.done.append("open")

    def close(self) -> None:
        self.done.append("close")

    def estimate(self, frame: Frame) -> tuple[Load, Area]:
        self.done.append("estimate")
        return Load(frame.timestamp_s), Area(2 * frame.timestamp_s)


class Carried(Estimator):
    """Needs what only the caller knows."""

    def estimate(self, load: Load, pose: External[RobotPose]) -> Brightness:
        return Brightness(load.newtons + pose.x_mm)


def test_a_step_may_give_several_quantities() -> None:
    result = Chain({"split": Split(Options(), CONTEXT)}).run(everything())
    load, area = result.by_type[Load], result.by_type[Area]
    assert isinstance(load, Load)
    assert isinstance(area, Area)
    assert area.mm2 == 2 * load.newtons
    assert result.steps["split"] is load


def test_two_producers_of_one_of_several_quantities_are_refused() -> None:
    steps = {"split": Split(Options(), CONTEXT), "scale": Scale(Options(), CONTEXT)}
    with pytest.raises(ProfileError, match="both provide Load"):
        Chain(steps)


def test_a_step_that_gives_one_of_two_quantities_is_caught() -> None:
    class Half(Split):
        def estimate(self, frame: Frame) -> tuple[Load, Area]:
            return (Load(1.0),)  # type: ignore[return-value]

    with pytest.raises(PluginError, match=r"returned 1 results instead of the Load and Area"):
        Chain({"split": Half(Options(), CONTEXT)}).run(everything())


def test_an_input_from_outside_is_given_with_the_frame() -> None:
    steps = {"split": Split(Options(), CONTEXT), "carried": Carried(Options(), CONTEXT)}
    chain = Chain(steps)
    chain.check({Frame})
    assert chain.external == {RobotPose}
    glow = chain.run({**everything(), RobotPose: RobotPose(3.0)}).by_type[Brightness]
    assert isinstance(glow, Brightness)
    assert glow.change == 3.0
    assert chain.run(everything()).left_out == {"carried": RobotPose}


def test_a_step_is_open_while_it_works() -> None:
    split = Split(Options(), CONTEXT)
    chain = Chain({"split": split})
    assert split.done == []
    chain.run(everything())
    chain.run(everything())
    chain.close()
    chain.close()
    assert split.done == ["open", "estimate", "estimate", "close"]


def test_a_copy_of_an_open_chain_opens_its_steps_itself() -> None:
    chain = Chain({"split": Split(Options(), CONTEXT)})
    chain.run(everything())
    copy = pickle.loads(pickle.dumps(chain))
    copy.run(everything())
    (step,) = copy.steps
    assert step.estimator.done == ["open", "estimate", "open", "estimate"]
