"""The chain of estimators: each step's annotations say what it takes and what it gives."""

from __future__ import annotations

import inspect
import types
from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

from tactile_core.errors import PluginError, ProfileError
from tactile_core.interfaces.estimator import Estimator
from tactile_core.plugins.blame import blame, fault
from tactile_core.quantities import Frame, Quantity
from tactile_core.quantities.array_form import form_fault

QuantityType = type[Quantity]


@dataclass(frozen=True)
class ChainResult:
    """What one frame gave.

    Attributes
    ----------
    by_type : mapping of type to Quantity
        What was given and what each step made of it.
    steps : mapping of step name to Quantity
        The result of each step that ran.
    left_out : mapping of step name to type
        The steps that could not run, each with the first input that was missing.
    """

    by_type: Mapping[QuantityType, Quantity]
    steps: Mapping[str, Quantity]
    left_out: Mapping[str, QuantityType]


@dataclass(frozen=True)
class Step:
    """A named estimator with what its annotations declare.

    Attributes
    ----------
    takes : tuple of type
        The arguments of ``estimate``, in order.
    needs : tuple of type
        Those of them that must be there; the rest are annotated ``X | None``.
    gives : type
        The quantity that ``estimate`` returns.
    """

    name: str
    estimator: Estimator
    takes: tuple[QuantityType, ...]
    needs: tuple[QuantityType, ...]
    gives: QuantityType

    def __str__(self) -> str:
        return _title(self.name, self.estimator)

    def blamed(self) -> AbstractContextManager[None]:
        """What fails inside the block becomes one message that names this step and its plugin."""
        return blame(f"step {self.name!r}", self.estimator)

    def missing(self, available: Collection[QuantityType]) -> QuantityType | None:
        """Return the first input that is needed and not available."""
        return next((kind for kind in self.needs if kind not in available), None)


class Chain:
    """Runs the steps of a profile in order, each on the quantities that it asks for.

    A step may take what comes with a frame and what an earlier step gives; types are matched
    exactly, one producer per type.

    Parameters
    ----------
    steps : mapping of name to Estimator
        In the order in which they run.

    Raises
    ------
    PluginError
        A step's ``estimate`` is missing or not fully annotated with quantities.
    ProfileError
        Two steps give the same quantity, or a step stands before the one that it depends on.
    """

    def __init__(self, steps: Mapping[str, Estimator]) -> None:
        self.steps = tuple(declared_step(name, estimator) for name, estimator in steps.items())
        _refuse_two_producers(self.steps)
        _refuse_wrong_order(self.steps)

    @property
    def stateful(self) -> bool:
        """Whether a reading depends on the frames before, so that frames must stay in order."""
        return any(step.estimator.stateful for step in self.steps)

    def left_out(self, given: Collection[QuantityType]) -> dict[str, QuantityType]:
        """Return the steps that cannot run on these types, each with the first one missing."""
        available, left_out = set(given), dict[str, QuantityType]()
        for step in self.steps:
            missing = step.missing(available)
            if missing is None:
                available.add(step.gives)
            else:
                left_out[step.name] = missing
        return left_out

    def check(self, given: Collection[QuantityType]) -> None:
        """Refuse a chain with a step that could never run.

        Parameters
        ----------
        given : collection of types
            Everything that may come with a frame, also what only a calibrated unit has.

        Raises
        ------
        ProfileError
            A step needs a quantity that is neither given nor made by any step.
        """
        known = {*given, *(step.gives for step in self.steps)}
        for step in self.steps:
            missing = step.missing(known)
            if missing is not None:
                raise ProfileError(
                    f"{step} needs {missing.__name__}, which no step gives; add a step that gives "
                    f"it before {step.name!r}, or remove {step.name!r}"
                )

    def run(self, given: Mapping[QuantityType, Quantity], *, tare: bool = False) -> ChainResult:
        """Run every step whose needs are met.

        Parameters
        ----------
        given : mapping of type to Quantity
            What came with the frame.
        tare : bool
            Take this frame's load for zero, already in what is returned.

        Raises
        ------
        ProfileError
            A step gives a type that was given already.
        PluginFault
            A step failed, or returned something else than it declares, or of another form.
        """
        by_type, results = dict(given), dict[str, Quantity]()
        frame = given.get(Frame)
        size = frame.pixels.shape[:2] if isinstance(frame, Frame) else None
        left_out = dict[str, QuantityType]()
        for step in self.steps:
            missing = step.missing(by_type)
            if missing is not None:
                left_out[step.name] = missing
                continue
            if step.gives in by_type:
                raise ProfileError(
                    f"{step} gives {step.gives.__name__}, which this sensor's calibration gives "
                    f"already; remove the step"
                )
            result = _estimate(step, by_type, size)
            if tare:
                with step.blamed():
                    tared = step.estimator.tare(result)
                result = _checked(step, tared, size)
            by_type[step.gives] = results[step.name] = result
        return ChainResult(by_type, results, left_out)

    def reset(self) -> None:
        """Let every step forget earlier frames."""
        for step in self.steps:
            with step.blamed():
                step.estimator.reset()


def declared_step(name: str, estimator: Estimator) -> Step:
    """Read what an estimator takes and gives from the annotations of its ``estimate``.

    Raises
    ------
    PluginError
        ``estimate`` is missing, or an annotation is missing, unknown or not a quantity.
    """
    title = _title(name, estimator)
    method = getattr(estimator, "estimate", None)
    if method is None:
        raise PluginError(f"{title} does not define estimate()")
    try:
        hints = get_type_hints(method)
        parameters = inspect.signature(method).parameters.values()
    except Exception as error:  # evaluating annotations runs whatever they say
        raise PluginError(
            f"{title}: the annotations of estimate() cannot be read ({error}); import their types "
            f"at run time, not only under TYPE_CHECKING"
        ) from error
    takes, needs = [], []
    for parameter in parameters:
        if parameter.kind not in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            raise PluginError(f"{title}: estimate() must take plain arguments, not {parameter}")
        kind, optional = _quantity(hints.get(parameter.name), f"{title}: {parameter.name!r}")
        takes.append(kind)
        if not optional:
            needs.append(kind)
    gives, optional = _quantity(hints.get("return"), f"{title}: the result")
    if optional:
        raise PluginError(f"{title}: the result of estimate() must be one quantity, never None")
    return Step(name, estimator, tuple(takes), tuple(needs), gives)


def without_marks(steps: Mapping[str, Estimator]) -> list[str]:
    """Return the steps that are of no use on a gel without marks.

    Those that need marks, and those that need what only these would give.
    """
    declared = [declared_step(name, estimator) for name, estimator in steps.items()]
    useless = [step for step in declared if step.estimator.needs_marks]
    while True:
        lost = {s.gives for s in useless} - {s.gives for s in declared if s not in useless}
        more = [s for s in declared if s not in useless and lost & set(s.needs)]
        if not more:
            return [step.name for step in declared if step in useless]
        useless += more


def _estimate(
    step: Step, by_type: Mapping[QuantityType, Quantity], size: tuple[int, ...] | None
) -> Quantity:
    with step.blamed():
        result = step.estimator.estimate(*(by_type.get(kind) for kind in step.takes))
    return _checked(step, result, size)


def _checked(step: Step, result: Any, size: tuple[int, ...] | None) -> Quantity:
    if not isinstance(result, step.gives):
        wrong = f"{type(result).__name__} instead of the {step.gives.__name__} that it declares"
    else:
        wrong = form_fault(result, size)
        wrong = wrong and f"a quantity of the wrong form: {wrong}"
    if wrong:
        raise fault(f"step {step.name!r}", step.estimator, f"returned {wrong}")
    checked: Quantity = result
    return checked


def _quantity(annotation: Any, what: str) -> tuple[QuantityType, bool]:
    options = [annotation]
    if get_origin(annotation) in (Union, types.UnionType):
        options = [option for option in get_args(annotation) if option is not type(None)]
    if (
        len(options) != 1
        or not isinstance(options[0], type)
        or not issubclass(options[0], Quantity)
    ):
        shown = inspect.formatannotation(annotation)
        said = "has no annotation" if annotation is None else f"is annotated {shown}"
        raise PluginError(f"{what} of estimate() {said}; annotate it with one Quantity type")
    return options[0], options[0] is not annotation


def _refuse_two_producers(steps: tuple[Step, ...]) -> None:
    producer: dict[QuantityType, Step] = {}
    for step in steps:
        first = producer.setdefault(step.gives, step)
        if first is not step:
            raise ProfileError(
                f"{first} and {step} both give {step.gives.__name__}; keep one and set the other "
                f"to null"
            )


def _refuse_wrong_order(steps: tuple[Step, ...]) -> None:
    for index, step in enumerate(steps):
        if step.gives in step.takes:
            raise ProfileError(f"{step} takes the {step.gives.__name__} that it gives itself")
        for later in steps[index + 1 :]:
            if later.gives in step.takes:
                raise ProfileError(
                    f"{step} takes {later.gives.__name__}, which only the later {later} gives; "
                    f"move {later.name!r} before {step.name!r}"
                )


def _title(name: str, estimator: Estimator) -> str:
    return f"step {name!r} ({type(estimator).__name__})"
