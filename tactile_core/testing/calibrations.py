"""Checks of calibrators and of the models that they fit to virtual presses of a ball."""

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
from tactile_core.testing.differences import CannotCheck, Fault, copy_arrays, difference, writable
from tactile_core.testing.plausibility import quantity_fault, truth_fault
from tactile_core.testing.registered import Part, Registered
from tactile_core.testing.virtual_presses import PRESSES, VirtualPress

_FLAT_SLOPE = 0.1  # Largest mean slope of the undeformed surface, mm/mm: 6°

# Largest mean height error of the undeformed surface, as a share of the press depth.
_FLAT_SHARE = 0.2


class CalibrationChecks(Suite):
    """The contract of calibrators, calibrations and artefacts."""

    @check(Registered.calibrators)
    def test_fit(self, part: Part) -> None:
        """The calibrator fits presses of a ball, and the same presses give the same model."""
        try:
            second = self.registered.fit(part)
            if not isinstance(second, Calibration):
                raise TypeError(f"fit() returns {type(second).__name__}, no Calibration")
        except CannotCheck:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"it cannot fit {PRESSES} virtual presses ({error})",
                why="no unit of the sensor can be calibrated",
                do="fit() receives pixels with known slopes; set options for the virtual sensor",
            ) from error
        first = self.registered.fit_once(part)
        frame = self.registered.rig(part).scenes[0].frame
        differs = difference(
            self._measure_frame(part, first, frame), self._measure_frame(part, second, frame)
        )
        if differs:
            raise Fault(
                part,
                f"two fits to the same presses measure differently: {differs}",
                why="a calibration and its score cannot be reproduced",
                do="draw random numbers only from np.random.default_rng(options.seed)",
            )

    @check(Registered.calibrators)
    def test_measurement(self, part: Part) -> None:
        """The result of a measurement has the image's size, is float32, finite and read-only."""
        scene = self.registered.rig(part).scenes[0]
        try:
            measured = self.registered.fit_once(part).measure(
                scene.frame, self.registered.rig(part).reference
            )
        except CannotCheck:
            raise
        except Exception as error:
            raise Fault(
                part,
                f"measure() fails ({type(error).__name__}: {error})",
                why="nothing can be measured",
                do="call it with the presses of the fit",
            ) from error
        wrong = (
            quantity_fault(measured, scene)
            if isinstance(measured, Gradients | HeightMap)
            else f"measure() returns {type(measured).__name__} instead of Gradients or a HeightMap"
        )
        if wrong:
            raise Fault(
                part,
                wrong,
                why="every later step relies on dtype, size and scale",
                do="return Gradients(x, y, valid, frame.mm_per_px, frame.timestamp_s), (H, W) "
                "float32 and bool; fill in pixels that cannot be measured and mark them not valid",
            )

    @check(Registered.calibrators)
    def test_orientation(self, part: Part) -> None:
        """A held-out ball rises towards the camera, and the undeformed surface is flat."""
        rig, model = self.registered.rig(part), self.registered.fit_once(part)
        scene = rig.scenes[1]
        wrong = truth_fault(self._measure_frame(part, model, scene.frame), scene)
        undeformed = self._measure_frame(part, model, rig.undeformed)
        wrong = wrong or _flatness_fault(undeformed, scene)
        if wrong:
            raise Fault(
                part,
                wrong,
                why="unit and sign are part of a quantity's type and are not checked at run time",
                do="x points right and y down; heights are in mm and positive where pressed",
            )

    @check(Registered.calibrators)
    def test_round_trip(self, part: Part) -> None:
        """A model gives the same results after saving and loading."""
        model = self.registered.fit_once(part)
        frame = self.registered.rig(part).scenes[0].frame
        with TemporaryDirectory(prefix="tactile-conformance-") as name:
            folder = Path(name)
            try:
                model.save(folder)
                loaded = type(model).load(folder)
            except Exception as error:
                found = f"its saved model cannot be loaded ({type(error).__name__}: {error})"
            else:
                before, after = (self._measure_frame(part, m, frame) for m in (model, loaded))
                differs = difference(before, after)
                found = f"it measures differently after loading: {differs}" if differs else ""
        if found:
            raise Fault(
                part,
                found,
                why="a bundle would measure differently from the calibration that was scored",
                do="save every fitted number in full precision",
            )

    @check(Registered.calibrators)
    def test_fitted_class(self, part: Part) -> None:
        """The class of the fitted model is registered and compensates drift like its calibrator."""
        model, calibrator = self.registered.fit_once(part), self.registered.class_of(part)
        name = type(model).__name__
        if registered_name("artefact", type(model)) is None:
            raise Fault(
                part,
                f"fit() returns {name}, which no plugin registers",
                why="a bundle names the class of its model, and only hooks resolve that name",
                do=f"return {name} from the hook tactile_artefacts",
            )
        if model.compensation != calibrator.compensation:
            raise Fault(
                part,
                f"it is fitted with compensation {calibrator.compensation!r}, but {name} measures "
                f"with {model.compensation!r}",
                why="the model would measure pixels that are prepared differently from the fit",
                do="declare the same compensation in both classes",
            )

    @check(Registered.artefacts)
    def test_empty_folder(self, part: Part) -> None:
        """Loading an empty folder raises CalibrationError."""
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
            why="a bundle with a missing file would give a traceback or wrong measurements",
            do="raise CalibrationError if files are missing",
        )

    @check(Registered.calibrators)
    def test_other_size(self, part: Part) -> None:
        """Measuring an image of another size raises CalibrationError."""
        rig, model = self.registered.rig(part), self.registered.fit_once(part)
        frame = rig.scenes[0].frame
        cropped = replace(frame, pixels=frame.pixels[:-8, :-8])
        reference = replace(rig.reference, pixels=rig.reference.pixels[:-8, :-8])
        try:
            model.measure(cropped, reference)
        except CalibrationError:
            return
        except Exception as error:
            found = f"raises {type(error).__name__} ({error})"
        else:
            found = "is measured"
        raise Fault(
            part,
            f"a frame of {_size(cropped)} {found}, although the fit had {_size(frame)}",
            why="illumination and scale belong to one image size; slopes would be silently wrong",
            do="store the fitted image shape and raise CalibrationError for any other",
        )

    @check(Registered.calibrators)
    def test_calibration_inputs(self, part: Part) -> None:
        """Measuring changes neither the frame nor the reference."""
        rig, model = self.registered.rig(part), self.registered.fit_once(part)
        given = writable({Frame: rig.scenes[0].frame, Reference: rig.reference})
        before = copy_arrays(given)
        frame, reference = given[Frame], given[Reference]
        assert isinstance(frame, Frame)
        assert isinstance(reference, Reference)
        self._measure_frame(part, model, frame, reference)
        changed = difference(before, copy_arrays(given))
        if changed:
            raise Fault(
                part,
                f"measure() changes its input: {changed}",
                why="recordings, estimators and the next frame use the same arrays",
                do="work on copies",
            )

    @check(Registered.calibrators)
    def test_calibration_pickling(self, part: Part) -> None:
        """A model can be pickled, also after measuring, and its copy measures the same."""
        model = self.registered.fit_once(part)
        frame = self.registered.rig(part).scenes[0].frame
        before = self._measure_frame(part, model, frame)
        try:
            copy = pickle.loads(pickle.dumps(model))
        except Exception as error:
            found = f"it cannot be pickled ({type(error).__name__}: {error})"
        else:
            found = difference(before, self._measure_frame(part, copy, frame))
            found = found and f"its pickled copy measures differently: {found}"
        if found:
            raise Fault(
                part,
                found,
                why="a Pipeline is pickled to run in other processes",
                do="leave locks, handles and caches out of __getstate__",
            )

    def _measure_frame(
        self, part: Part, model: Calibration, frame: Frame, reference: Reference | None = None
    ) -> Quantity:
        try:
            return model.measure(frame, reference or self.registered.rig(part).reference)
        except Exception as error:
            raise CannotCheck(f"see the check 'measurement': {error}") from error


def _flatness_fault(undeformed: Quantity, scene: VirtualPress) -> str:
    """Return why a measurement of the undeformed surface is not flat; "" if it is flat."""
    if isinstance(undeformed, Gradients):
        slope = float(np.hypot(undeformed.x, undeformed.y).mean())
        if slope > _FLAT_SLOPE:
            return f"the undeformed surface has a mean slope of {slope:.2g}"
    if isinstance(undeformed, HeightMap):
        error_mm = float(np.abs(undeformed.mm).mean())
        if error_mm > _FLAT_SHARE * scene.height_mm.max():
            return f"the undeformed surface has a mean height error of {error_mm:.2g} mm"
    return ""


def _size(frame: Frame) -> str:
    height, width = frame.pixels.shape[:2]
    return f"{width} × {height}"
