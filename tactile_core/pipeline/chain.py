"""The chain of estimators; each step's annotations declare its inputs and outputs."""

from __future__ import annotations

import inspect
from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args, get_origin, get_type_hints

from tactile_core.algorithms.arrays.types import Parts, parts
from tactile_core.errors import PluginError, ProfileError
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.estimator import EXTERNAL, Estimator
from tactile_core.plugins.blame import blame, fault
from tactile_core.quantities import Frame, Quantity
from tactile_core.quantities.array_form import form_fault, writable_field
from tactile_core.quantities.fields import fields_of

QuantityType = type[Quantity]

_UNANNOTATED = Parts((), ())


@dataclass(frozen=True)
class ChainResult:
    """Result of one frame.

    Attributes
    ----------
    by_type : mapping of type to Quantity
        The inputs and the output of each step.
    steps : mapping of step name to Quantity
        The result of each step that ran.
    left_out : mapping of step name to type
        The steps that could not run, each with its first missing input.
    """

    by_type: Mapping[QuantityType, Quantity]
    steps: Mapping[str, Quantity]
    left_out: Mapping[str, QuantityType]


@dataclass(frozen=True)
class Step:
    """A named estimator and the declarations in its annotations.

    Attributes
    ----------
    takes : tuple of type
        The arguments of ``estimate``, in order.
    needs : tuple of type
        The required arguments; the others are annotated ``X | None``.
    gives : tuple of type
        The quantities that ``estimate`` returns.
    external : frozenset of type
        The inputs that the caller supplies with each frame.
    """

    name: str
    estimator: Estimator
    takes: tuple[QuantityType, ...]
    needs: tuple[QuantityType, ...]
    gives: tuple[QuantityType, ...]
    external: frozenset[QuantityType] = frozenset()

    def __str__(self) -> str:
        return _title(self.name, self.estimator)

    def blame_step(self) -> AbstractContextManager[None]:
        """Convert exceptions inside the block to an error that names this step and its plugin."""
        return self._blame

    @cached_property
    def _blame(self) -> AbstractContextManager[None]:
        return blame(f"step {self.name!r}", self.estimator)

    def estimate(self, given: Mapping[QuantityType, Quantity]) -> tuple[Any, ...]:
        """Run the estimator on the quantities that it takes; return its results."""
        return _tuple(self.estimator.estimate(*map(given.get, self.takes)))

    def missing(self, available: Collection[QuantityType]) -> QuantityType | None:
        """Return the first required input that is not available."""
        for kind in self.needs:
            if kind not in available:
                return kind
        return None


@dataclass(frozen=True)
class _Plan:
    """What runs if quantities of certain types are given.

    Attributes
    ----------
    steps : tuple of Step
    left_out : mapping of step name to type
        The other steps, each with its first missing input.
    """

    steps: tuple[Step, ...]
    left_out: Mapping[str, QuantityType]


class Chain:
    """Runs the steps of a profile in order and passes quantities between them.

    A step can take what comes with a frame and what an earlier step returns. Types are matched
    exactly, and each type has one producer.

    Parameters
    ----------
    steps : mapping of name to Estimator
        In execution order.

    Raises
    ------
    PluginError
        A step's ``estimate`` is missing or not fully annotated with quantities.
    ProfileError
        Two steps return the same quantity, or a step precedes one that it depends on.
    """

    def __init__(self, steps: Mapping[str, Estimator]) -> None:
        self.steps = tuple(declared_step(name, estimator) for name, estimator in steps.items())
        self._opened = False
        self._plans: dict[frozenset[QuantityType], _Plan] = {}
        _refuse_two_producers(self.steps)
        _refuse_wrong_order(self.steps)

    @cached_property
    def external(self) -> frozenset[QuantityType]:
        """The inputs that the caller must supply with each frame for every step to run."""
        return frozenset().union(*(step.external for step in self.steps))

    @property
    def stateful(self) -> bool:
        """Whether a reading depends on earlier frames, so that frames must stay in order."""
        return any(step.estimator.stateful for step in self.steps)

    def left_out(self, given: Collection[QuantityType]) -> dict[str, QuantityType]:
        """Return the steps that cannot run on these types, each with its first missing input."""
        return dict(self._plan(given).left_out)

    def _plan(self, given: Collection[QuantityType]) -> _Plan:
        """Choose the steps that can run on these types, once for each set of types."""
        types = frozenset(given)
        if types not in self._plans:
            available, runs, left_out = set(types), list[Step](), dict[str, QuantityType]()
            for step in self.steps:
                missing = step.missing(available)
                if missing is None:
                    runs.append(step)
                    available |= set(step.gives)
                else:
                    left_out[step.name] = missing
            self._plans[types] = _Plan(tuple(runs), left_out)
        return self._plans[types]

    def check(self, given: Collection[QuantityType]) -> None:
        """Raise an error if a step can never run.

        Parameters
        ----------
        given : collection of types
            Everything that can come with a frame, including what only a calibrated unit provides.

        Raises
        ------
        ProfileError
            A step needs a quantity that neither comes with a frame nor from another step, nor is
            fitted to the unit.
        """
        known = {*given, *self.external, *(kind for step in self.steps for kind in step.gives)}
        known |= {kind for step in self.steps for kind in step.takes if issubclass(kind, Artefact)}
        for step in self.steps:
            missing = step.missing(known)
            if missing is not None:
                raise ProfileError(
                    f"{step} needs {missing.__name__}, which no step provides; add a step that "
                    f"provides it before {step.name!r}, or remove {step.name!r}"
                )

    def run(self, given: Mapping[QuantityType, Quantity], *, tare: bool = False) -> ChainResult:
        """Run every step whose inputs are available.

        Parameters
        ----------
        given : mapping of type to Quantity
            What came with the frame.
        tare : bool
            Subtract this frame's load, starting with the returned result.

        Raises
        ------
        ProfileError
            A step returns a type that is already present.
        PluginFault
            A step failed, or its result does not match its declaration.
        """
        self.open()
        by_type, results = dict(given), dict[str, Quantity]()
        frame = given.get(Frame)
        size = frame.pixels.shape[:2] if isinstance(frame, Frame) else None
        plan = self._plan(given)
        for step in plan.steps:
            for kind in step.gives:
                if kind in by_type:
                    raise ProfileError(
                        f"{step} provides {kind.__name__}, which this sensor's calibration "
                        f"already provides; remove the step"
                    )
            with step.blame_step():
                found = step.estimate(by_type)
            _refuse_writing(step, by_type)
            found = _check_results(step, found, size)
            if tare:
                with step.blame_step():
                    tared = step.estimator.tare(found[0] if len(found) == 1 else found)
                found = _check_results(step, _tuple(tared), size)
            by_type.update(zip(step.gives, found, strict=True))
            results[step.name] = found[0]
        return ChainResult(by_type, results, plan.left_out)

    def open(self) -> None:
        """Open every step; do nothing if they are already open."""
        if not self._opened:
            for step in self.steps:
                with step.blame_step():
                    step.estimator.open()
            self._opened = True

    def close(self) -> None:
        """Close every step."""
        if self._opened:
            self._opened = False
            for step in self.steps:
                with step.blame_step():
                    step.estimator.close()

    def __getstate__(self) -> dict[str, Any]:
        # a copy in another process opens its own resources
        return {**vars(self), "_opened": False, "_plans": {}}

    def reset(self) -> None:
        """Make every step forget earlier frames."""
        for step in self.steps:
            with step.blame_step():
                step.estimator.reset()

    def resume(self) -> None:
        """Make every step continue after a gap in the frames."""
        for step in self.steps:
            with step.blame_step():
                step.estimator.resume()


def declared_step(name: str, estimator: Estimator) -> Step:
    """Read an estimator's inputs and outputs from the annotations of its ``estimate``.

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
        hints = get_type_hints(method, include_extras=True)
        meant = {name: parts(annotation) for name, annotation in hints.items()}
        parameters = inspect.signature(method).parameters.values()
    except Exception as error:  # evaluating annotations executes arbitrary code
        raise PluginError(
            f"{title}: the annotations of estimate() cannot be read ({error}); import their types "
            f"at run time, not only under TYPE_CHECKING"
        ) from error
    takes, needs, external = [], [], set()
    for parameter in parameters:
        if parameter.kind not in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            raise PluginError(f"{title}: estimate() must take plain arguments, not {parameter}")
        annotated = meant.get(parameter.name, _UNANNOTATED)
        kind, optional = _quantity(annotated, f"{title}: {parameter.name!r}")
        takes.append(kind)
        if EXTERNAL in annotated.extras:
            external.add(kind)
        if not optional:
            needs.append(kind)
    gives = [
        _quantity(one, f"{title}: the result")
        for one in _results(meant.get("return", _UNANNOTATED))
    ]
    if any(optional for _, optional in gives):
        raise PluginError(f"{title}: the result of estimate() must be one quantity, never None")
    kinds = tuple(kind for kind, _ in gives)
    for kind in kinds:
        fields_of(kind)  # report mistakes now rather than with the first frame
    return Step(name, estimator, tuple(takes), tuple(needs), kinds, frozenset(external))


def without_markers(steps: Mapping[str, Estimator]) -> list[str]:
    """Return the steps that cannot work on a gel without markers.

    These are the steps that need markers and the steps that need the results of those.
    """
    declared = [declared_step(name, estimator) for name, estimator in steps.items()]
    useless = [step for step in declared if step.estimator.needs_markers]
    while True:
        left = {kind for s in declared if s not in useless for kind in s.gives}
        lost = {kind for s in useless for kind in s.gives} - left
        more = [s for s in declared if s not in useless and lost & set(s.needs)]
        if not more:
            return [step.name for step in declared if step in useless]
        useless += more


def _tuple(result: Any) -> tuple[Any, ...]:
    return result if isinstance(result, tuple) else (result,)


def _check_results(
    step: Step, results: tuple[Any, ...], size: tuple[int, ...] | None
) -> tuple[Quantity, ...]:
    """Raise an error if results differ from the step's declaration in type or form."""
    wrong = ""
    if len(results) != len(step.gives):
        declared = " and ".join(kind.__name__ for kind in step.gives)
        wrong = f"{len(results)} results instead of the {declared} that it declares"
    for result, kind in zip(results, step.gives, strict=False):
        if not isinstance(result, kind):
            mismatch = f"{type(result).__name__} instead of the {kind.__name__} that it declares"
        else:
            mismatch = form_fault(result, size)
            mismatch = mismatch and f"a quantity of the wrong form: {mismatch}"
        wrong = wrong or mismatch
    if wrong:
        raise fault(f"step {step.name!r}", step.estimator, f"returned {wrong}")
    return results


def _results(annotated: Parts) -> list[Parts]:
    """Return what is declared of each quantity in a result, which is a tuple of several."""
    if [get_origin(member) for member in annotated.members] != [tuple]:
        return [annotated]
    return [parts(each) for each in get_args(annotated.members[0])]


def _quantity(annotated: Parts, what: str) -> tuple[QuantityType, bool]:
    kinds = annotated.types
    if len(kinds) != 1 or not isinstance(kinds[0], type) or not issubclass(kinds[0], Quantity):
        shown = " | ".join(inspect.formatannotation(kind) for kind in kinds) or "None"
        actual = "has no annotation" if annotated is _UNANNOTATED else f"is annotated {shown}"
        raise PluginError(f"{what} of estimate() {actual}; annotate it with one Quantity type")
    return kinds[0], kinds != annotated.members


def _refuse_writing(step: Step, given: Mapping[QuantityType, Quantity]) -> None:
    """Raise an error if a step has made an input writable, which all later steps read, too."""
    for kind in step.takes:
        field = writable_field(given[kind]) if kind in given else ""
        if field:
            what = f"made {field} writable, which other steps read; it must change a copy"
            raise fault(f"step {step.name!r}", step.estimator, what)


def _refuse_two_producers(steps: tuple[Step, ...]) -> None:
    producer: dict[QuantityType, Step] = {}
    for step in steps:
        for kind in step.gives:
            first = producer.setdefault(kind, step)
            if first is not step:
                raise ProfileError(
                    f"{first} and {step} both provide {kind.__name__}; keep one and set the other "
                    f"to null"
                )


def _refuse_wrong_order(steps: tuple[Step, ...]) -> None:
    for index, step in enumerate(steps):
        for kind in set(step.gives) & set(step.takes):
            raise ProfileError(f"{step} takes the {kind.__name__} that it provides itself")
        for later in steps[index + 1 :]:
            for kind in set(later.gives) & set(step.takes):
                raise ProfileError(
                    f"{step} takes {kind.__name__}, which only the later {later} provides; move "
                    f"{later.name!r} before {step.name!r}"
                )


def _title(name: str, estimator: Estimator) -> str:
    return f"step {name!r} ({type(estimator).__name__})"
