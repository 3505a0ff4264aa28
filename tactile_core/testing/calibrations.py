"""Checks of calibrators and of the models that they fit on virtual presses of a ball."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.plugins.registry import registered_name
from tactile_core.quantities import Frame, Gradients, HeightMap, Quantity, Reference
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import difference, kept, writable
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.plausibility import quantity_fault, truth_fault
from tactile_core.testing.registered import Part, Registered
from tactile_core.testing.virtual_presses import PRESSES, VirtualPress

_FLAT_SLOPE = 0.1
"""Mean slope of untouched skin that no model may exceed: 6°."""

_FLAT_SHARE = 0.2
"""Mean distance of untouched skin from height 0, over the depth of a press."""


class CalibrationChecks(Suite):
    """The contract of calibrators, calibrations and artefacts."""

    @check(Registered.calibrators)
    def test_fit(self, part: Part) -> None:
        """A model is fitted on presses of a ball, and the same presses give the same model."""
        try:
            second = self.registered.fit(part)
            if not isinstance(second, Calibration):
                raise TypeError(f"fit() returns {type(second).__name__}, no Calibration")
        except Unjudged:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"it cannot be fitted on {PRESSES} virtual presses ({error})",
                why="no unit of the sensor can be calibrated",
                do="fit() takes pixels of known slope; give options for the virtual sensor",
            ) from error
        first = self.registered.fitted(part)
        frame = self.registered.rig(part).scenes[0].frame
        differs = difference(
            self._measured(part, first, frame), self._measured(part, second, frame)
        )
        if differs:
            raise Fault(
                part,
                f"two fits on the same presses measure differently: {differs}",
                why="a calibration could not be repeated, nor its score trusted",
                do="draw random numbers from np.random.default_rng(options.seed) alone",
            )

    @check(Registered.calibrators)
    def test_measurement(self, part: Part) -> None:
        """What it measures has the image's size, float32, no gaps, and cannot be written to."""
        scene = self.registered.rig(part).scenes[0]
        try:
            measured = self.registered.fitted(part).measure(
                scene.frame, self.registered.rig(part).reference
            )
        except Unjudged:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"measure() fails ({type(error).__name__}: {error})",
                why="nothing can be measured",
                do="try it on the presses that it was fitted on",
            ) from error
        wrong = (
            quantity_fault(measured, scene)
            if isinstance(measured, Gradients | HeightMap)
            else f"measure() returns {type(measured).__name__}, neither Gradients nor HeightMap"
        )
        if wrong:
            raise Fault(
                part,
                wrong,
                why="every step after it relies on dtype, size and scale",
                do="Gradients(x, y, valid, frame.mm_per_px, frame.timestamp_s), (H, W) float32 "
                "and bool; fill in what cannot be measured and mark it not valid",
            )

    @check(Registered.calibrators)
    def test_sense(self, part: Part) -> None:
        """A ball that it has not seen rises towards the camera; untouched skin is flat."""
        rig, model = self.registered.rig(part), self.registered.fitted(part)
        scene = rig.scenes[1]
        wrong = truth_fault(self._measured(part, model, scene.frame), scene)
        rest = self._measured(part, model, rig.undeformed)
        wrong = wrong or _unlevel(rest, scene)
        if wrong:
            raise Fault(
                part,
                wrong,
                why="unit and sign are part of a quantity's type; nobody checks them again",
                do="x is right, y down, heights in mm are positive where the object presses",
            )

    @check(Registered.calibrators)
    def test_round_trip(self, part: Part) -> None:
        """A model that was saved and loaded measures the same."""
        model = self.registered.fitted(part)
        frame = self.registered.rig(part).scenes[0].frame
        with TemporaryDirectory(prefix="tactile-conformance-") as name:
            folder = Path(name)
            try:
                model.save(folder)
                loaded = type(model).load(folder)
            except Exception as error:
                found = f"what it saves cannot be loaded ({type(error).__name__}: {error})"
            else:
                before, after = (self._measured(part, m, frame) for m in (model, loaded))
                differs = difference(before, after)
                found = f"saved and loaded, it measures otherwise: {differs}" if differs else ""
        if found:
            raise Fault(
                part,
                found,
                why="a bundle would measure otherwise than the calibration that was scored",
                do="save every fitted number in full precision",
            )

    @check(Registered.calibrators)
    def test_fitted_class(self, part: Part) -> None:
        """The class of what is fitted is registered, and compensates as its calibrator does."""
        model, calibrator = self.registered.fitted(part), self.registered.class_of(part)
        name = type(model).__name__
        if registered_name("artefact", type(model)) is None:
            raise Fault(
                part,
                f"fit() returns {name}, which no plugin registers",
                why="a bundle names the class of its model, and only hooks turn a name into one",
                do=f"return {name} from the hook tactile_artefacts",
            )
        if model.compensation != calibrator.compensation:
            raise Fault(
                part,
                f"it is fitted with compensation {calibrator.compensation!r}, and {name} measures "
                f"with {model.compensation!r}",
                why="a model would measure other pixels than it was fitted on",
                do="say the same compensation in both classes",
            )

    @check(Registered.artefacts)
    def test_empty_folder(self, part: Part) -> None:
        """An empty folder is refused with a CalibrationError."""
        cls = self.registered.class_of(part)
        with TemporaryDirectory(prefix="tactile-conformance-") as name:
            try:
                cls.load(Path(name))
            except CalibrationError:
                return
            except Exception as error:
                found = f"loading an empty folder raises {type(error).__name__} ({error})"
            else:
                found = "loading an empty folder gives a model"
        raise Fault(
            part,
            found,
            why="a bundle that lacks a file would end in a traceback, or measure anything",
            do="raise CalibrationError where files are missing",
        )

    @check(Registered.calibrators)
    def test_other_size(self, part: Part) -> None:
        """An image of another size is refused with a CalibrationError."""
        rig, model = self.registered.rig(part), self.registered.fitted(part)
        frame = rig.scenes[0].frame
        cut = replace(frame, pixels=frame.pixels[:-8, :-8])
        reference = replace(rig.reference, pixels=rig.reference.pixels[:-8, :-8])
        try:
            model.measure(cut, reference)
        except CalibrationError:
            return
        except Exception as error:
            found = f"raises {type(error).__name__} ({error})"
        else:
            found = "is measured"
        raise Fault(
            part,
            f"a frame of {_size(cut)} {found}, though it was fitted on {_size(frame)}",
            why="light and scale belong to one image size; the slopes would be wrong in silence",
            do="keep the shape that was fitted and raise CalibrationError for another",
        )

    @check(Registered.calibrators)
    def test_calibration_inputs(self, part: Part) -> None:
        """Measuring changes neither the frame nor the reference."""
        rig, model = self.registered.rig(part), self.registered.fitted(part)
        given = writable({Frame: rig.scenes[0].frame, Reference: rig.reference})
        before = kept(given)
        frame, reference = given[Frame], given[Reference]
        assert isinstance(frame, Frame)
        assert isinstance(reference, Reference)
        self._measured(part, model, frame, reference)
        changed = difference(before, kept(given))
        if changed:
            raise Fault(
                part,
                f"measure() changes its input: {changed}",
                why="recordings, estimators and the next frame see what it left",
                do="work on copies",
            )

    @check(Registered.calibrators)
    def test_calibration_pickling(self, part: Part) -> None:
        """A model pickles, also after measuring, and measures the same afterwards."""
        model = self.registered.fitted(part)
        frame = self.registered.rig(part).scenes[0].frame
        before = self._measured(part, model, frame)
        try:
            copy = pickle.loads(pickle.dumps(model))
        except Exception as error:
            found = f"it does not pickle ({type(error).__name__}: {error})"
        else:
            found = difference(before, self._measured(part, copy, frame))
            found = found and f"its pickled copy measures otherwise: {found}"
        if found:
            raise Fault(
                part,
                found,
                why="a Pipeline is sent to other processes for recordings and for robots",
                do="leave locks, handles and caches out of __getstate__",
            )

    def _measured(
        self, part: Part, model: Calibration, frame: Frame, reference: Reference | None = None
    ) -> Quantity:
        try:
            return model.measure(frame, reference or self.registered.rig(part).reference)
        except Exception as error:
            raise Unjudged(f"see the check 'measurement': {error}") from error


def _unlevel(rest: Quantity, scene: VirtualPress) -> str:
    """Say how what is measured of the undeformed sensor is not flat; empty where it is."""
    if isinstance(rest, Gradients):
        slope = float(np.hypot(rest.x, rest.y).mean())
        return f"untouched skin has a mean slope of {slope:.2g}" if slope > _FLAT_SLOPE else ""
    if isinstance(rest, HeightMap):
        off_mm = float(np.abs(rest.mm).mean())
        if off_mm > _FLAT_SHARE * scene.height_mm.max():
            return f"untouched skin is measured {off_mm:.2g} mm off its place"
    return ""


def _size(frame: Frame) -> str:
    height, width = frame.pixels.shape[:2]
    return f"{width} × {height}"
