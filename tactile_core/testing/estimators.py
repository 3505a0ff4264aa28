"""Checks of estimators, on a few virtual presses that follow each other."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from copy import deepcopy

from tactile_core.errors import PluginError
from tactile_core.formats.saved_quantities import arrays_of, quantities_in
from tactile_core.interfaces.estimator import Estimator
from tactile_core.pipeline.chain import Step, declared_step
from tactile_core.quantities import Quantity
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import difference, kept, writable
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.needed_quantities import completed
from tactile_core.testing.plausibility import quantity_fault, truth_fault
from tactile_core.testing.registered import Part, Registered
from tactile_core.testing.virtual_presses import VirtualPress
from tactile_core.views.pictures import picture_of

GivenQuantities = Mapping[type[Quantity], Quantity]
_STATE = "set stateful: ClassVar[bool] = True and forget everything in reset(), or keep nothing"


class EstimatorChecks(Suite):
    """The contract of :class:`tactile_core.interfaces.estimator.Estimator`."""

    @check(Registered.estimators)
    def test_annotations(self, part: Part) -> None:
        """``estimate`` is annotated with quantities, and what it needs can be had."""
        try:
            step = declared_step(part.use, self._made(part))
        except PluginError as error:
            raise Fault(
                part,
                str(error),
                why="the annotations are the declaration by which a chain is put together",
                do="def estimate(self, height: HeightMap) -> ContactMask: …",
            ) from error
        missing = step.missing(self._given(part, step, self._scenes(part)[0]))
        if missing is not None:
            raise Fault(
                part,
                f"it needs {missing.__name__}, which neither the core nor this plugin gives",
                why="no profile could run it",
                do="take a quantity of tactile_core.quantities, register an estimator that gives "
                "it, or return one from inputs() in the test class",
            )

    @check(Registered.estimators)
    def test_output(self, part: Part) -> None:
        """It gives the declared quantity, with the documented dtype and shape, not writable."""
        step = self._step(part)
        for scene in self._scenes(part):
            try:
                results = step.estimate(self._known(part, step, scene))
            except Unjudged:
                raise
            except Exception as error:
                raise Fault(
                    part,
                    f"estimate() fails ({type(error).__name__}: {error})",
                    why="the whole reading fails with it",
                    do="try it on an ordinary press; inputs are read-only, so work on copies",
                ) from error
            if len(results) == len(step.gives) and all(map(isinstance, results, step.gives)):
                wrong = next(filter(None, (quantity_fault(r, scene) for r in results)), "")
            else:
                returned = ", ".join(type(result).__name__ for result in results)
                declared = ", ".join(kind.__name__ for kind in step.gives)
                wrong = f"it returns {returned} and declares {declared}"
            if wrong:
                raise Fault(
                    part,
                    wrong,
                    why="steps, files and viewers after it rely on what the quantity documents",
                    do="see the quantity's docstring in tactile_core.quantities",
                )

    @check(Registered.estimators)
    def test_units(self, part: Part) -> None:
        """A ball's height, slopes and contact come out in mm, the right way up and about right."""
        for results, scene in zip(self._results(part), self._scenes(part), strict=True):
            wrong = next(filter(None, (truth_fault(result, scene) for result in results)), "")
            if wrong:
                raise Fault(
                    part,
                    wrong,
                    why="unit, frame and sign are part of a quantity's type; nobody asks again",
                    do="multiply by mm_per_px where it is due; heights are positive where pressed",
                )

    @check(Registered.estimators)
    def test_export(self, part: Part) -> None:
        """Each quantity is JSON, arrays from which it is made again, and what can be drawn."""
        results, scene = self._results(part)[0], self._scenes(part)[0]
        try:
            json.dumps([dict(result.summary()) for result in results], allow_nan=True)
            [picture_of(scene.frame, result.layers()) for result in results]
            arrays = arrays_of(results, mm_per_px=1.0)
            objects = [n for n, a in arrays.items() if a.dtype == object]
            found = f"arrays() holds objects in {', '.join(objects)}" if objects else ""
            if not found:
                again = quantities_in(arrays, *map(type, results)).values()
                found = difference(arrays, arrays_of(again, mm_per_px=1.0))
                found = found and f"from_arrays() does not make what arrays() gave: {found}"
        except Exception as error:
            found = f"summary(), arrays() or layers() fails ({type(error).__name__}: {error})"
        if found:
            raise Fault(
                part,
                found,
                why="every quantity is printed, saved, read back and drawn by these",
                do="annotate each field with what it holds, FieldSpec(unit, axes); float(…) and "
                "int(…) in summary(), numeric arrays in arrays()",
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
                f"after reset() the same frames give something else: {differs}",
                why="a recording could not be measured twice alike",
                do="forget in reset() all that estimate() remembers, and seed random numbers there",
            )

    @check(Registered.estimators)
    def test_state(self, part: Part) -> None:
        """A step that does not declare ``stateful`` gives each frame the same result anew."""
        step = self._step(part)
        if step.estimator.stateful:
            raise Unjudged("it declares its state")
        together = self._results(part, step)
        inputs = [self._known(part, step, scene) for scene in self._scenes(part)]
        for number in reversed(range(len(inputs))):
            again = self._step(part)
            differs = difference(together[number], _tried(again, inputs[number]))
            if differs:
                raise Fault(
                    part,
                    f"a frame's result depends on the frames before it: {differs}",
                    why="recordings are shared out over processes unless a step declares a state",
                    do=_STATE,
                )

    @check(Registered.estimators)
    def test_instances(self, part: Part) -> None:
        """Two estimators at work side by side know nothing of each other."""
        alone = self._results(part, self._step(part))
        one, other = self._step(part), self._step(part)
        scenes = self._scenes(part)
        mixed = []
        for scene, elsewhere in zip(scenes, reversed(scenes), strict=True):
            mixed.append(deepcopy(_tried(one, self._known(part, one, scene))))
            _tried(other, self._known(part, other, elsewhere))
        differs = difference(alone, mixed)
        if differs:
            raise Fault(
                part,
                f"its results change when another one is at work: {differs}",
                why="two fingers of one gripper would disturb each other",
                do="keep state in self, never in the class or the module",
            )

    @check(Registered.estimators)
    def test_own_result(self, part: Part) -> None:
        """A result stays as it is when the next frame is measured."""
        step = self._step(part)
        first, second = (self._known(part, step, scene) for scene in self._scenes(part)[:2])
        results = {type(result): result for result in _tried(step, first)}
        before = kept(results)
        _tried(step, second)
        differs = difference(before, kept(results))
        if differs:
            raise Fault(
                part,
                f"the next frame overwrites the result: {differs}",
                why="readings are kept, compared and saved later",
                do="return a new array, not the buffer that is used again",
            )

    @check(Registered.estimators)
    def test_inputs(self, part: Part) -> None:
        """Estimating changes none of its inputs."""
        step = self._step(part)
        given = writable(self._known(part, step, self._scenes(part)[0]))
        before = kept(given)
        _tried(step, given)
        differs = difference(before, kept(given))
        if differs:
            raise Fault(
                part,
                f"estimate() changes its input: {differs}",
                why="other steps get the same arrays, before or after it",
                do="work on copies",
            )

    @check(Registered.estimators)
    def test_pickling(self, part: Part) -> None:
        """An estimator pickles, new and used, and goes on with the same results."""
        step = self._step(part)
        for when in ("new", "used"):
            try:
                copy = pickle.loads(pickle.dumps(step.estimator))
            except Exception as error:
                found = f"when {when} it does not pickle ({type(error).__name__}: {error})"
            else:
                copied = declared_step(part.use, copy)
                found = difference(self._results(part, step), self._results(part, copied))
                found = found and f"when {when}, its pickled copy gives something else: {found}"
            if found:
                raise Fault(
                    part,
                    found,
                    why="a Pipeline is sent to other processes for recordings and for robots",
                    do="leave locks, sessions and open files out of __getstate__, and make them "
                    "anew when they are needed",
                )

    def _made(self, part: Part) -> Estimator:
        try:
            made: Estimator = self.registered.make(part)
        except Unjudged:
            raise
        except Exception as error:
            raise Unjudged(f"see the check 'construction': {error}") from error
        return made

    def _step(self, part: Part) -> Step:
        try:
            step = declared_step(part.use, self._made(part))
        except PluginError as error:
            raise Unjudged(f"see the check 'annotations': {error}") from error
        try:
            step.estimator.open()
        except Exception as error:
            raise Unjudged(f"open() fails ({type(error).__name__}: {error})") from error
        return step

    def _scenes(self, part: Part) -> tuple[VirtualPress, ...]:
        return self.registered.rig(part).scenes

    def _given(self, part: Part, step: Step, scene: VirtualPress) -> GivenQuantities:
        known = {**scene.truth, **self.inputs(scene)}
        context = self.registered.rig(part).context
        return completed(known, step.needs, self.registered, context, without=step.name)

    def _known(self, part: Part, step: Step, scene: VirtualPress) -> GivenQuantities:
        given = self._given(part, step, scene)
        missing = step.missing(given)
        if missing is not None:
            raise Unjudged(f"see the check 'annotations': there is no {missing.__name__}")
        return {kind: given[kind] for kind in step.takes if kind in given}

    def _results(self, part: Part, step: Step | None = None) -> list[tuple[Quantity, ...]]:
        step = step or self._step(part)
        # Copies, so that a buffer that is used again confuses no comparison but its own.
        return [
            deepcopy(_tried(step, self._known(part, step, scene))) for scene in self._scenes(part)
        ]


def _tried(step: Step, given: GivenQuantities) -> tuple[Quantity, ...]:
    try:
        return step.estimate(given)
    except Exception as error:
        raise Unjudged(f"see the check 'output': {error}") from error
