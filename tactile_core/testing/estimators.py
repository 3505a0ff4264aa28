"""Checks of estimators."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from copy import deepcopy
from functools import cache

from tactile_core.formats.npz import arrays_of, quantities_in
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.pipeline.chain import Step, declared_step
from tactile_core.quantities import Quantity
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import (
    CannotCheck,
    change_of_inputs,
    copy_arrays,
    depend_on,
    describe_error,
    difference,
    pickling_fault,
    report,
    report_errors,
)
from tactile_core.testing.plausibility import quantity_fault, truth_fault
from tactile_core.testing.registered import Part, Registered
from tactile_core.testing.virtual_presses import VirtualPress
from tactile_core.views.pictures import picture_of

KnownQuantities = Mapping[type[Quantity], Quantity]


def complete_quantities(
    known: KnownQuantities,
    needs: Collection[type[Quantity]],
    registered: Registered,
    context: SensorContext,
    *,
    without: str,
) -> dict[type[Quantity], Quantity]:
    """Add the missing quantities, computed by estimators of the plugin or of the core.

    Parameters
    ----------
    known : mapping of type to Quantity
    needs : collection of types
    registered : Registered
    context : SensorContext
        The sensor of the quantities.
    without : str
        The estimator under test, which is not used.
    """
    made = dict(known)
    if made.keys() >= set(needs):
        return made
    steps = list(_steps(registered, context, without))
    while step := next((s for s in steps if _is_useful(s, made)), None):
        steps.remove(step)
        try:
            step.estimator.open()
            made.update(zip(step.gives, step.estimate(made), strict=True))
        except Exception:  # its own checks report it
            continue
    return made


def _is_useful(step: Step, made: Mapping[type[Quantity], Quantity]) -> bool:
    return not made.keys() >= set(step.gives) and step.missing(made) is None


@cache
def _core() -> Registered:
    """What the core registers, whose profiles take long to load."""
    return Registered("core", {})


def _steps(registered: Registered, context: SensorContext, without: str) -> Iterator[Step]:
    for source in (registered, _core()):
        for part in source.parts("estimator"):
            try:
                if part.use != without:
                    yield declared_step(part.use, source.make(part, context))
            except Exception:  # its own checks report it
                continue


class EstimatorChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.estimator.Estimator`."""

    @check("estimator")
    def test_annotations(self, part: Part) -> None:
        """``estimate`` is annotated with quantities, and its inputs are available."""
        estimator: Estimator = self.registered.make_or_skip(part)
        with report_errors(
            part,
            "the chain of steps cannot hold it",
            why="the core builds the chain of steps from the annotations",
            do="def estimate(self, height: HeightMap) -> ContactMask: …",
        ):
            step = declared_step(part.use, estimator)
        missing = step.missing(self._complete_inputs(part, step, self._scenes(part)[0]))
        report(
            part,
            ""
            if missing is None
            else f"it needs {missing.__name__}, which neither the core nor this plugin provides",
            why="no profile could run it",
            do="use a quantity of tactile_core.quantities, register an estimator that provides "
            "it, or return one from inputs() in the test class",
        )

    @check("estimator")
    def test_output(self, part: Part) -> None:
        """It returns the declared quantity, read-only, with the documented dtype and shape."""
        step = self._step(part)
        for scene in self._scenes(part):
            given = self._select_inputs(part, step, scene)
            with report_errors(
                part,
                "estimate() fails",
                why="the whole reading fails",
                do="test it with an ordinary press; inputs are read-only, so work on copies",
            ):
                results = step.estimate(given)
            if len(results) == len(step.gives) and all(map(isinstance, results, step.gives)):
                wrong = next(filter(None, (quantity_fault(r, scene) for r in results)), "")
            else:
                returned = ", ".join(type(result).__name__ for result in results)
                declared = ", ".join(kind.__name__ for kind in step.gives)
                wrong = f"it returns {returned} but declares {declared}"
            report(
                part,
                wrong,
                why="later steps, files and viewers rely on the quantity's documented form",
                do="see the quantity's docstring in tactile_core.quantities",
            )

    @check("estimator")
    def test_units(self, part: Part) -> None:
        """Height, slopes and contact of a ball have the right unit, sign and magnitude."""
        for results, scene in zip(self._results(part), self._scenes(part), strict=True):
            report(
                part,
                next(filter(None, (truth_fault(result, scene) for result in results)), ""),
                why="unit, frame and sign are part of a quantity's type and are not checked "
                "at run time",
                do="convert with mm_per_px; heights are positive where the ball presses",
            )

    @check("estimator")
    def test_export(self, part: Part) -> None:
        """Each quantity can be printed as JSON, saved, restored and drawn."""
        results, scene = self._results(part)[0], self._scenes(part)[0]
        why = "these methods print, save, restore and draw every quantity"
        do = (
            "annotate each field with FieldSpec(unit, axes); use float(…) and int(…) in summary() "
            "and numeric arrays in arrays()"
        )
        with report_errors(part, "summary(), arrays() or layers() fails", why=why, do=do):
            json.dumps([dict(result.summary()) for result in results], allow_nan=True)
            [picture_of(scene.frame, result.layers()) for result in results]
            arrays = arrays_of(results, mm_per_px=1.0)
            again = quantities_in(arrays, *map(type, results)).values()
            differs = difference(arrays, arrays_of(again, mm_per_px=1.0))
        report(
            part,
            differs and f"from_arrays() does not restore the result of arrays(): {differs}",
            why=why,
            do=do,
        )

    @check("estimator")
    def test_reset(self, part: Part) -> None:
        """After ``reset()`` the same frames give the same results."""
        step = self._step(part)
        first = self._results(part, step)
        step.estimator.reset()
        differs = difference(first, self._results(part, step))
        report(
            part,
            differs and f"after reset() the same frames give different results: {differs}",
            why="measuring a recording twice, or with two fingers, would give different results",
            do="keep state in self, clear it in reset(), and seed random numbers there",
        )

    @check("estimator")
    def test_state(self, part: Part) -> None:
        """The result of a frame depends on earlier frames only if ``stateful`` is declared."""
        step = self._step(part)
        if step.estimator.stateful:
            raise CannotCheck("it declares stateful")
        together = self._results(part, step)
        inputs = [self._select_inputs(part, step, scene) for scene in self._scenes(part)]
        for number in reversed(range(len(inputs))):
            differs = difference(together[number], _try_step(self._step(part), inputs[number]))
            report(
                part,
                differs and f"a frame's result depends on the frames before it: {differs}",
                why="recordings are measured in parallel unless a step declares stateful",
                do="set stateful = True and clear the state in reset(), or keep no state",
            )

    @check("estimator")
    def test_separate_results(self, part: Part) -> None:
        """A result does not change when the next frame is measured."""
        step = self._step(part)
        first, second = (self._select_inputs(part, step, scene) for scene in self._scenes(part)[:2])
        results = {type(result): result for result in _try_step(step, first)}
        before = copy_arrays(results)
        _try_step(step, second)
        differs = difference(before, copy_arrays(results))
        report(
            part,
            differs and f"the next frame overwrites the result: {differs}",
            why="readings are kept, compared and saved later",
            do="return a new array, not a reused buffer",
        )

    @check("estimator")
    def test_inputs(self, part: Part) -> None:
        """Estimating does not change its inputs."""
        step = self._step(part)
        given = self._select_inputs(part, step, self._scenes(part)[0])
        changed = change_of_inputs(given, lambda copies: _try_step(step, copies))
        report(
            part,
            changed and f"estimate() changes its input: {changed}",
            why="other steps use the same arrays",
            do="work on copies",
        )

    @check("estimator")
    def test_pickling(self, part: Part) -> None:
        """An estimator can be pickled, new and used, and its copy gives the same results."""
        step = self._step(part)
        for when in ("new", "used"):
            found = pickling_fault(
                step.estimator, lambda one: self._results(part, declared_step(part.use, one))
            )
            report(
                part,
                found and f"when {when} {found}",
                why="a Pipeline is pickled to run in other processes",
                do="leave locks, sessions and open files out of __getstate__, and create them "
                "again when they are needed",
            )

    def _step(self, part: Part) -> Step:
        estimator: Estimator = self.registered.make_or_skip(part)
        with depend_on("annotations"):
            step = declared_step(part.use, estimator)
        try:
            step.estimator.open()
        except Exception as error:
            raise CannotCheck(f"open() fails ({describe_error(error)})") from error
        return step

    def _scenes(self, part: Part) -> tuple[VirtualPress, ...]:
        return self.registered.rig(part).scenes

    def _complete_inputs(self, part: Part, step: Step, scene: VirtualPress) -> KnownQuantities:
        known = {**scene.truth, **self.inputs(scene)}
        context = self.registered.rig(part).context
        return complete_quantities(known, step.needs, self.registered, context, without=step.name)

    def _select_inputs(self, part: Part, step: Step, scene: VirtualPress) -> KnownQuantities:
        given = self._complete_inputs(part, step, scene)
        missing = step.missing(given)
        if missing is not None:
            raise CannotCheck(f"see the check 'annotations': {missing.__name__} is missing")
        return {kind: given[kind] for kind in step.takes if kind in given}

    def _results(self, part: Part, step: Step | None = None) -> list[tuple[Quantity, ...]]:
        step = step or self._step(part)
        # Copies, so that a reused buffer fails only the check for it.
        return [
            deepcopy(_try_step(step, self._select_inputs(part, step, scene)))
            for scene in self._scenes(part)
        ]


def _try_step(step: Step, given: KnownQuantities) -> tuple[Quantity, ...]:
    with depend_on("output"):
        return step.estimate(given)
