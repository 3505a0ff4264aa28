"""The annotations of ``estimate()`` define the inputs and results of a chain's steps."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import pytest
from pydantic import BaseModel
from typing_extensions import TypeAliasType

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
from tactile_core.quantities.array_form import form_fault

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
        self.frames = 0

    def estimate(self, frame: Frame) -> Area:
        self.frames += 1
        return Area(float(self.frames))

    def reset(self) -> None:
        self.frames = 0


class Failing(Estimator):
    def estimate(self, frame: Frame) -> Area:
        raise InputError("the frame is upside down")


class WrongResult(Estimator):
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


def test_each_step_gets_the_quantities_of_its_annotations() -> None:
    result = chain(height=Height, contact=Contact, area=Measure).run(everything())
    assert isinstance(result.steps["height"], HeightMap)
    assert result.by_type[HeightMap] is result.steps["height"]
    assert result.by_type[Gradients] is GRADIENTS
    area = result.by_type[Area]
    assert isinstance(area, Area)
    assert area.mm2 == pytest.approx(12 * 0.01)
    assert list(result.steps) == ["height", "contact", "area"]
    assert result.left_out == {}


def test_the_given_quantities_are_not_modified() -> None:
    given = everything()
    chain(height=Height).run(given)
    assert given == everything()


def test_an_empty_chain_returns_the_given_quantities() -> None:
    assert chain().run(everything()).by_type == everything()


@pytest.mark.parametrize("cls", [Glow, OldStyleGlow])
def test_an_optional_input_can_be_missing(cls: type[Estimator]) -> None:
    glow = chain(glow=cls)
    without = glow.run({Frame: FRAME}).by_type[Brightness]
    with_it = glow.run({Frame: FRAME, Reference: REFERENCE}).by_type[Brightness]
    assert isinstance(without, Brightness)
    assert isinstance(with_it, Brightness)
    assert without.change is None
    assert with_it.change is not None


def test_a_step_without_its_input_is_left_out_with_its_dependents() -> None:
    steps = chain(height=Height, contact=Contact, area=Measure, glow=Glow)
    missing = {"height": Gradients, "contact": HeightMap, "area": ContactMask}
    assert steps.left_out({Frame}) == missing
    result = steps.run({Frame: FRAME})
    assert result.left_out == missing
    assert list(result.steps) == ["glow"]


def test_the_predicted_left_out_steps_are_those_left_out() -> None:
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


def test_a_step_that_provides_a_given_quantity_is_rejected() -> None:
    with pytest.raises(ProfileError, match=r"'height' .* provides HeightMap"):
        chain(height=Height).run({**everything(), HeightMap: HEIGHT})


def test_two_steps_that_provide_one_quantity_are_both_named() -> None:
    with pytest.raises(ProfileError) as caught:
        chain(height=Height, better=OtherHeight)
    message = str(caught.value)
    assert "'height' (Height)" in message
    assert "'better' (OtherHeight)" in message
    assert "HeightMap" in message


def test_a_wrong_order_is_rejected_with_the_step_to_move() -> None:
    correct: dict[str, type[Estimator]] = {"height": Height, "contact": Contact, "area": Measure}
    for order in permutations(correct):
        if list(order) == list(correct):
            continue
        with pytest.raises(ProfileError, match=r"move '(height|contact)' before"):
            chain(**{name: correct[name] for name in order})


def test_a_step_that_needs_its_own_result_is_rejected() -> None:
    with pytest.raises(ProfileError, match=r"'area' .* provides itself"):
        chain(area=Circular)


def test_a_step_that_can_never_run_is_rejected() -> None:
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
def test_an_invalid_annotation_is_reported_with_step_and_class(
    cls: type[Estimator], fault: str
) -> None:
    with pytest.raises(PluginError, match=fault) as caught:
        chain(mystery=cls)
    assert f"'mystery' ({cls.__name__})" in str(caught.value)


def test_an_error_in_a_step_propagates_with_its_name() -> None:
    with pytest.raises(InputError, match="upside down") as caught:
        chain(look=Failing).run(everything())
    assert caught.value.__notes__ == [f"raised by step 'look' ({__name__}.Failing)"]


def test_a_result_of_another_type_than_declared_is_rejected() -> None:
    with pytest.raises(PluginError, match=r"'area' .* returned HeightMap instead of the Area"):
        chain(area=WrongResult).run(everything())


def test_a_declared_step_has_inputs_needs_and_results() -> None:
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


def test_a_chain_with_a_stateful_step_is_stateful() -> None:
    assert chain(height=Height, count=Counter).stateful
    assert not chain(height=Height).stateful


def test_a_pickled_chain_keeps_its_state() -> None:
    steps = chain(height=Height, count=Counter)
    steps.run(everything())
    copy = pickle.loads(pickle.dumps(steps))
    assert copy.run(everything()).by_type[Area].mm2 == 2


@dataclass(frozen=True, eq=False)
class Load(Quantity):
    newtons: float


class Scale(Estimator):
    """Reports the frame's timestamp as a load."""

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


class DoubleLoad(Estimator):
    def estimate(self, load: Load) -> Area:
        return Area(2 * load.newtons)


def measured(chain: Chain, time_s: float, *, tare: bool = False) -> float:
    frame = Frame(FRAME.pixels, FRAME.channels, 0.1, timestamp_s=time_s)
    area = chain.run({Frame: frame}, tare=tare).by_type[Area]
    assert isinstance(area, Area)
    return area.mm2


def test_a_tare_subtracts_that_frames_load_until_reset() -> None:
    chain = Chain({"scale": Scale(Options(), CONTEXT), "double": DoubleLoad(Options(), CONTEXT)})
    assert measured(chain, 3.0, tare=True) == 0.0
    assert measured(chain, 4.0) == 2.0
    chain.reset()
    assert measured(chain, 4.0) == 8.0


def test_the_tared_frame_reads_zero_in_all_steps() -> None:
    chain = Chain({"scale": Scale(Options(), CONTEXT), "double": DoubleLoad(Options(), CONTEXT)})
    assert measured(chain, 5.0, tare=True) == 0.0
    assert measured(chain, 6.0) == 2.0


def test_the_tared_frame_is_estimated_once() -> None:
    scale = Scale(Options(), CONTEXT)
    measured(Chain({"scale": scale, "double": DoubleLoad(Options(), CONTEXT)}), 5.0, tare=True)
    assert scale.estimated == 1


def test_the_result_of_a_tare_is_checked() -> None:
    class NoResult(Scale):
        def tare(self, result: Load) -> Load:
            return None  # type: ignore[return-value]

    steps = {"scale": NoResult(Options(), CONTEXT), "double": DoubleLoad(Options(), CONTEXT)}
    with pytest.raises(PluginError, match=r"'scale' .* returned NoneType instead of the Load"):
        measured(Chain(steps), 5.0, tare=True)


def test_steps_that_need_markers_are_found_with_their_dependents() -> None:
    steps = {"scale": Scale(Options(), CONTEXT), "double": DoubleLoad(Options(), CONTEXT)}
    assert without_markers(steps) == ["scale", "double"]
    assert without_markers({"height": Height(Options(), CONTEXT)}) == []


@dataclass(frozen=True, eq=False)
class RobotPose(Quantity):
    x_mm: float


class Split(Estimator):
    """Provides two quantities, and records its calls."""

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self.calls: list[str] = []

    def open(self) -> None:
        self.calls.append("open")

    def close(self) -> None:
        self.calls.append("close")

    def estimate(self, frame: Frame) -> tuple[Load, Area]:
        self.calls.append("estimate")
        return Load(frame.timestamp_s), Area(2 * frame.timestamp_s)


Glowing = TypeAliasType("Glowing", Load | None)
Both = TypeAliasType("Both", tuple[Brightness, Area])
Posed = TypeAliasType("Posed", External[RobotPose])


class Aliased(Estimator):
    """Annotated with aliases."""

    def estimate(self, load: Glowing, pose: Posed) -> Both:
        return Brightness(load.newtons if load else pose.x_mm), Area(pose.x_mm)


class Carried(Estimator):
    """Needs an external quantity."""

    def estimate(self, load: Load, pose: External[RobotPose]) -> Brightness:
        return Brightness(load.newtons + pose.x_mm)


def test_a_step_can_provide_several_quantities() -> None:
    result = Chain({"split": Split(Options(), CONTEXT)}).run(everything())
    load, area = result.by_type[Load], result.by_type[Area]
    assert isinstance(load, Load)
    assert isinstance(area, Area)
    assert area.mm2 == 2 * load.newtons
    assert result.steps["split"] is load


def test_aliases_mean_what_they_stand_for() -> None:
    step = declared_step("aliased", Aliased(Options(), CONTEXT))
    assert step.takes == (Load, RobotPose)
    assert step.needs == (RobotPose,)
    assert step.external == {RobotPose}
    assert step.gives == (Brightness, Area)


def test_two_steps_that_provide_a_common_quantity_are_rejected() -> None:
    steps = {"split": Split(Options(), CONTEXT), "scale": Scale(Options(), CONTEXT)}
    with pytest.raises(ProfileError, match="both provide Load"):
        Chain(steps)


def test_a_step_that_returns_one_of_two_quantities_is_rejected() -> None:
    class Half(Split):
        def estimate(self, frame: Frame) -> tuple[Load, Area]:
            return (Load(1.0),)  # type: ignore[return-value]

    with pytest.raises(PluginError, match=r"returned 1 results instead of the Load and Area"):
        Chain({"split": Half(Options(), CONTEXT)}).run(everything())


def test_an_external_input_is_given_with_the_frame() -> None:
    steps = {"split": Split(Options(), CONTEXT), "carried": Carried(Options(), CONTEXT)}
    chain = Chain(steps)
    chain.check({Frame})
    assert chain.external == {RobotPose}
    glow = chain.run({**everything(), RobotPose: RobotPose(3.0)}).by_type[Brightness]
    assert isinstance(glow, Brightness)
    assert glow.change == 3.0
    assert chain.run(everything()).left_out == {"carried": RobotPose}


def test_a_step_is_opened_at_first_use_and_closed_once() -> None:
    split = Split(Options(), CONTEXT)
    chain = Chain({"split": split})
    assert split.calls == []
    chain.run(everything())
    chain.run(everything())
    chain.close()
    chain.close()
    assert split.calls == ["open", "estimate", "estimate", "close"]


def test_a_copy_of_an_open_chain_opens_its_own_steps() -> None:
    chain = Chain({"split": Split(Options(), CONTEXT)})
    chain.run(everything())
    copy = pickle.loads(pickle.dumps(chain))
    copy.run(everything())
    (step,) = copy.steps
    assert step.estimator.calls == ["open", "estimate", "open", "estimate"]


class Overwriting(Estimator):
    """Makes its input writable and changes it."""

    def estimate(self, gradients: Gradients) -> Brightness:
        gradients.x.flags.writeable = True
        return Brightness(0.0)


def test_a_step_that_makes_its_input_writable_is_named() -> None:
    message = r"step 'bright' .* made Gradients\.x writable.*it must change a copy"
    with pytest.raises(PluginError, match=message):
        chain(bright=Overwriting).run(everything())


class Ending(Estimator):
    """Raises what a generator raises that is closed."""

    def estimate(self, frame: Frame) -> Brightness:
        raise GeneratorExit


def test_every_exception_of_a_step_is_its_fault() -> None:
    with pytest.raises(PluginError, match=r"step 'ends' .* failed: GeneratorExit"):
        chain(ends=Ending).run(everything())


@dataclass(frozen=True, eq=False)
class Count(Quantity):
    events: int
    mean: float = 0.0


@pytest.mark.parametrize("value", [10**400, 2**63, -(2**70), 1.5])
def test_a_number_that_no_file_holds_is_a_fault_of_the_step(value: int) -> None:
    class Counting(Estimator):
        def estimate(self, frame: Frame) -> Count:
            return Count(value)

    with pytest.raises(PluginError, match=r"Count\.events is .*"):
        chain(counts=Counting).run(everything())
    assert form_fault(Count(3, 10**400))
    assert form_fault(Count(2**63 - 1)) == ""
