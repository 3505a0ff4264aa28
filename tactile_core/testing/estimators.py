"""Checks of estimators."""

from __future__ import annotations

import json
import pickle
from collections.abc import Collection, Iterator, Mapping
from copy import deepcopy
from functools import cache

from tactile_core.errors import PluginError
from tactile_core.formats.npz import arrays_of, quantities_in
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.pipeline.chain import Step, declared_step
from tactile_core.quantities import Quantity
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import CannotCheck, Fault, copy_arrays, difference, writable
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
        for part in source.estimators():
            try:
                if part.use != without:
                    yield declared_step(part.use, source.make(part, context))
            except Exception:  # its own checks report it
                continue


GivenQuantities = Mapping[type[Quantity], Quantity]
# Advice for an estimator with undeclared state.
_STATE = "set stateful = True and clear the state in reset(), or keep no state"


class EstimatorChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.estimator.Estimator`."""

    @check(Registered.estimators)
    def test_annotations(self, part: Part) -> None:
        """``estimate`` is annotated with quantities, and its inputs are available."""
        try:
            step = declared_step(part.use, self._make_estimator(part))
        except PluginError as error:
            raise Fault(
                part,
                str(error),
                why="the core builds the chain of steps from the annotations",
                do="def estimate(self, height: HeightMap) -> ContactMask: …",
            ) from error
        missing = step.missing(self._complete_inputs(part, step, self._scenes(part)[0]))
        if missing is not None:
            raise Fault(
                part,
                f"it needs {missing.__name__}, which neither the core nor this plugin provides",
                why="no profile could run it",
                do="use a quantity of tactile_core.quantities, register an estimator that provides "
                "it, or return one from inputs() in the test class",
            )

    @check(Registered.estimators)
    def test_output(self, part: Part) -> None:
        """It returns the declared quantity, read-only, with the documented dtype and shape."""
        step = self._step(part)
        for scene in self._scenes(part):
            try:
                results = step.estimate(self._select_inputs(part, step, scene))
            except CannotCheck:
                raise
            except Exception as error:
                raise Fault(
                    part,
                    f"estimate() fails ({type(error).__name__}: {error})",
                    why="the whole reading fails",
                    do="test it with an ordinary press; inputs are read-only, so work on copies",
                ) from error
            if len(results) == len(step.gives) and all(map(isinstance, results, step.gives)):
                wrong = next(filter(None, (quantity_fault(r, scene) for r in results)), "")
            else:
                returned = ", ".join(type(result).__name__ for result in results)
                declared = ", ".join(kind.__name__ for kind in step.gives)
                wrong = f"it returns {returned} but declares {declared}"
            if wrong:
                raise Fault(
                    part,
                    wrong,
                    why="later steps, files and viewers rely on the quantity's documented form",
                    do="see the quantity's docstring in tactile_core.quantities",
                )

    @check(Registered.estimators)
    def test_units(self, part: Part) -> None:
        """Height, slopes and contact of a ball have the right unit, sign and magnitude."""
        for results, scene in zip(self._results(part), self._scenes(part), strict=True):
            wrong = next(filter(None, (truth_fault(result, scene) for result in results)), "")
            if wrong:
                raise Fault(
                    part,
                    wrong,
                    why="unit, frame and sign are part of a quantity's type and are not checked "
                    "at run time",
                    do="convert with mm_per_px; heights are positive where the ball presses",
                )

    @check(Registered.estimators)
    def test_export(self, part: Part) -> None:
        """Each quantity can be printed as JSON, saved, restored and drawn."""
        results, scene = self._results(part)[0], self._scenes(part)[0]
        try:
            json.dumps([dict(result.summary()) for result in results], allow_nan=True)
            [picture_of(scene.frame, result.layers()) for result in results]
            arrays = arrays_of(results, mm_per_px=1.0)
            objects = [n for n, a in arrays.items() if a.dtype == object]
            found = f"arrays() contains objects in {', '.join(objects)}" if objects else ""
            if not found:
                again = quantities_in(arrays, *map(type, results)).values()
                found = difference(arrays, arrays_of(again, mm_per_px=1.0))
                found = found and f"from_arrays() does not restore the result of arrays(): {found}"
        except Exception as error:
            found = f"summary(), arrays() or layers() fails ({type(error).__name__}: {error})"
        if found:
            raise Fault(
                part,
                found,
                why="these methods print, save, restore and draw every quantity",
                do="annotate each field with FieldSpec(unit, axes); use float(…) and int(…) in "
                "summary() and numeric arrays in arrays()",
            )

    @check(Registered.estimators)
    def test_reset(self, part: Part) -> None:
        """After ``reset()`` the same frames give the same results."""
        step = self._step(part)
        first = self._results(part, step)
        step.estimator.reset()
        differs = difference(first, self._results(part, step))
        if differs:
            raise Fault(
                part,
                f"after reset() the same frames give different results: {differs}",
                why="measuring a recording twice would give different results",
                do="clear the state of estimate() in reset(), and seed random numbers there",
            )

    @check(Registered.estimators)
    def test_state(self, part: Part) -> None:
        """The result of a frame depends on earlier frames only if ``stateful`` is declared."""
        step = self._step(part)
        if step.estimator.stateful:
            raise CannotCheck("it declares stateful")
        together = self._results(part, step)
        inputs = [self._select_inputs(part, step, scene) for scene in self._scenes(part)]
        for number in reversed(range(len(inputs))):
            again = self._step(part)
            differs = difference(together[number], _try_step(again, inputs[number]))
            if differs:
                raise Fault(
                    part,
                    f"a frame's result depends on the frames before it: {differs}",
                    why="recordings are measured in parallel unless a step declares stateful",
                    do=_STATE,
                )

    @check(Registered.estimators)
    def test_instances(self, part: Part) -> None:
        """Two estimators of the same class do not affect each other."""
        alone = self._results(part, self._step(part))
        one, other = self._step(part), self._step(part)
        scenes = self._scenes(part)
        mixed = []
        for scene, other_scene in zip(scenes, reversed(scenes), strict=True):
            mixed.append(deepcopy(_try_step(one, self._select_inputs(part, one, scene))))
            _try_step(other, self._select_inputs(part, other, other_scene))
        differs = difference(alone, mixed)
        if differs:
            raise Fault(
                part,
                f"its results change while another instance is in use: {differs}",
                why="two fingers of one gripper would affect each other",
                do="keep state in self, never in the class or the module",
            )

    @check(Registered.estimators)
    def test_separate_results(self, part: Part) -> None:
        """A result does not change when the next frame is measured."""
        step = self._step(part)
        first, second = (self._select_inputs(part, step, scene) for scene in self._scenes(part)[:2])
        results = {type(result): result for result in _try_step(step, first)}
        before = copy_arrays(results)
        _try_step(step, second)
        differs = difference(before, copy_arrays(results))
        if differs:
            raise Fault(
                part,
                f"the next frame overwrites the result: {differs}",
                why="readings are kept, compared and saved later",
                do="return a new array, not a reused buffer",
            )

    @check(Registered.estimators)
    def test_inputs(self, part: Part) -> None:
        """Estimating does not change its inputs."""
        step = self._step(part)
        given = writable(self._select_inputs(part, step, self._scenes(part)[0]))
        before = copy_arrays(given)
        _try_step(step, given)
        differs = difference(before, copy_arrays(given))
        if differs:
            raise Fault(
                part,
                f"estimate() changes its input: {differs}",
                why="other steps use the same arrays",
                do="work on copies",
            )

    @check(Registered.estimators)
    def test_pickling(self, part: Part) -> None:
        """An estimator can be pickled, new and used, and its copy gives the same results."""
        step = self._step(part)
        for when in ("new", "used"):
            try:
                copy = pickle.loads(pickle.dumps(step.estimator))
            except Exception as error:
                found = f"when {when} it cannot be pickled ({type(error).__name__}: {error})"
            else:
                copied = declared_step(part.use, copy)
                found = difference(self._results(part, step), self._results(part, copied))
                found = found and f"when {when}, its pickled copy gives other results: {found}"
            if found:
                raise Fault(
                    part,
                    found,
                    why="a Pipeline is pickled to run in other processes",
                    do="leave locks, sessions and open files out of __getstate__, and create them "
                    "again when they are needed",
                )

    def _make_estimator(self, part: Part) -> Estimator:
        try:
            made: Estimator = self.registered.make(part)
        except CannotCheck:
            raise
        except Exception as error:
            raise CannotCheck(f"see the check 'construction': {error}") from error
        return made

    def _step(self, part: Part) -> Step:
        try:
            step = declared_step(part.use, self._make_estimator(part))
        except PluginError as error:
            raise CannotCheck(f"see the check 'annotations': {error}") from error
        try:
            step.estimator.open()
        except Exception as error:
            raise CannotCheck(f"open() fails ({type(error).__name__}: {error})") from error
        return step

    def _scenes(self, part: Part) -> tuple[VirtualPress, ...]:
        return self.registered.rig(part).scenes

    def _complete_inputs(self, part: Part, step: Step, scene: VirtualPress) -> GivenQuantities:
        known = {**scene.truth, **self.inputs(scene)}
        context = self.registered.rig(part).context
        return complete_quantities(known, step.needs, self.registered, context, without=step.name)

    def _select_inputs(self, part: Part, step: Step, scene: VirtualPress) -> GivenQuantities:
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


def _try_step(step: Step, given: GivenQuantities) -> tuple[Quantity, ...]:
    try:
        return step.estimate(given)
    except Exception as error:
        raise CannotCheck(f"see the check 'output': {error}") from error
