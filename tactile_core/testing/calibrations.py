"""Checks of calibrators and of the models that they fit to virtual presses of a ball."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactile_core.errors import CalibrationError, InputError
from tactile_core.interfaces.calibration import Calibration
from tactile_core.plugins.registry import registered_name
from tactile_core.quantities import Frame, Gradients, HeightMap, Quantity, Reference
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import (
    Fault,
    change_of_inputs,
    depend_on,
    describe_error,
    difference,
    report,
    report_errors,
)
from tactile_core.testing.plausibility import quantity_fault, truth_fault
from tactile_core.testing.registered import Part
from tactile_core.testing.virtual_presses import PRESSES, VirtualPress


class CalibrationChecks(Suite):
    """The contract of calibrators, calibrations and artefacts."""

    @check("calibrator")
    def test_fit(self, part: Part) -> None:
        """The calibrator fits presses of a ball, and the same presses give the same model."""
        self.registered.skip_refusing(part)
        with report_errors(
            part,
            f"it cannot fit {PRESSES} virtual presses",
            why="no unit of the sensor can be calibrated",
            do="fit() receives pixels with known slopes; set options for the virtual sensor",
        ):
            second = self.registered.fit(part)
            if not isinstance(second, Calibration):
                raise TypeError(f"fit() returns {type(second).__name__}, no Calibration")
        first = self.registered.fit_once(part)
        frame = self.registered.rig(part).scenes[0].frame
        differs = difference(self._measure(part, first, frame), self._measure(part, second, frame))
        report(
            part,
            differs and f"two fits to the same presses measure differently: {differs}",
            why="a calibration and its score cannot be reproduced",
            do="draw random numbers only from np.random.default_rng(options.seed)",
        )

    @check("calibrator")
    def test_measurement(self, part: Part) -> None:
        """The result of a measurement has the image's size, is float32, finite and read-only."""
        scene = self.registered.rig(part).scenes[0]
        model = self.registered.fit_once(part)
        with report_errors(
            part,
            "measure() fails",
            why="nothing can be measured",
            do="call it with the presses of the fit",
        ):
            measured = model.measure(scene.frame, self.registered.rig(part).reference)
        report(
            part,
            quantity_fault(measured, scene)
            if isinstance(measured, Gradients | HeightMap)
            else f"measure() returns {type(measured).__name__} instead of Gradients or a HeightMap",
            why="every later step relies on dtype, size and scale",
            do="return Gradients(x, y, valid, frame.mm_per_px, frame.timestamp_s), (H, W) "
            "float32 and bool; fill in pixels that cannot be measured and mark them not valid",
        )

    @check("calibrator")
    def test_orientation(self, part: Part) -> None:
        """A held-out ball rises towards the camera, and the undeformed surface is flat."""
        rig, model = self.registered.rig(part), self.registered.fit_once(part)
        scene = rig.scenes[1]
        wrong = truth_fault(self._measure(part, model, scene.frame), scene)
        undeformed = self._measure(part, model, rig.undeformed)
        report(
            part,
            wrong or _flatness_fault(undeformed, scene),
            why="unit and sign are part of a quantity's type and are not checked at run time",
            do="x points right and y down; heights are in mm and positive where pressed",
        )

    @check("calibrator")
    def test_round_trip(self, part: Part) -> None:
        """A model gives the same results after saving and loading, and as a pickled copy."""
        model = self.registered.fit_once(part)
        frame = self.registered.rig(part).scenes[0].frame
        before = self._measure(part, model, frame)
        for words, copied in (("after loading", _reload), ("after pickling", _pickle)):
            why = "a bundle, or another process, would measure differently from the fitted model"
            do = "save every number in full precision, and leave locks and caches out of a pickle"
            with report_errors(part, f"it cannot be used {words}", why=why, do=do):
                copy = copied(model)
            differs = difference(before, self._measure(part, copy, frame))
            report(part, differs and f"it measures differently {words}: {differs}", why=why, do=do)

    @check("calibrator")
    def test_fitted_class(self, part: Part) -> None:
        """The class of the fitted model is registered and compensates drift like its calibrator."""
        model, calibrator = self.registered.fit_once(part), self.registered.class_of(part)
        name = type(model).__name__
        report(
            part,
            ""
            if registered_name("artefact", type(model))
            else f"fit() returns {name}, which no plugin registers",
            why="a bundle names the class of its model, and only hooks resolve that name",
            do=f"return {name} from the hook tactile_artefacts",
        )
        report(
            part,
            ""
            if model.compensation == calibrator.compensation
            else f"it is fitted with compensation {calibrator.compensation!r}, but {name} measures "
            f"with {model.compensation!r}",
            why="the model would measure pixels that are prepared differently from the fit",
            do="declare the same compensation in both classes",
        )

    @check("artefact")
    def test_empty_folder(self, part: Part) -> None:
        """Loading an empty folder raises CalibrationError."""
        cls = self.registered.class_of(part)
        with TemporaryDirectory(prefix="tactile-conformance-") as name:
            try:
                cls.load(Path(name))
            except CalibrationError:
                return
            except Exception as error:
                found = f"loading an empty folder raises {describe_error(error)}"
            else:
                found = "loading an empty folder gives a model"
        raise Fault(
            part,
            found,
            why="a bundle with a missing file would give a traceback or wrong measurements",
            do="raise CalibrationError if files are missing",
        )

    @check("importer")
    def test_foreign_file(self, part: Part) -> None:
        """Reading a file of another kind raises InputError."""
        importer = self.registered.class_of(part)()
        with TemporaryDirectory(prefix="tactile-conformance-") as name:
            file = Path(name, "picture.png")
            file.write_bytes(bytes(range(256)))
            try:
                importer.read(file, self.registered.rig(part).profile)
            except InputError:
                return
            except Exception as error:
                found = f"reading a file of another kind raises {describe_error(error)}"
            else:
                found = "reading a file of another kind gives a model"
        raise Fault(
            part,
            found,
            why="a wrong file would be called a fault of the plugin, or would measure wrongly",
            do="raise InputError, with one sentence that says which file is expected",
        )

    @check("calibrator")
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
            found = f"raises {describe_error(error)}"
        else:
            found = "is measured"
        raise Fault(
            part,
            f"a frame of {_size(cropped)} {found}, although the fit had {_size(frame)}",
            why="illumination and scale belong to one image size; slopes would be silently wrong",
            do="store the fitted image shape and raise CalibrationError for any other",
        )

    @check("calibrator")
    def test_calibration_inputs(self, part: Part) -> None:
        """Measuring changes neither the frame nor the reference."""
        rig, model = self.registered.rig(part), self.registered.fit_once(part)
        changed = change_of_inputs(
            {Frame: rig.scenes[0].frame, Reference: rig.reference},
            lambda given: self._measure(part, model, given[Frame], given[Reference]),
        )
        report(
            part,
            changed and f"measure() changes its input: {changed}",
            why="recordings, estimators and the next frame use the same arrays",
            do="work on copies",
        )

    def _measure(
        self, part: Part, model: Calibration, frame: Frame, reference: Reference | None = None
    ) -> Quantity:
        with depend_on("measurement"):
            return model.measure(frame, reference or self.registered.rig(part).reference)


def _reload(model: Calibration) -> Calibration:
    with TemporaryDirectory(prefix="tactile-conformance-") as name:
        model.save(Path(name))
        return type(model).load(Path(name))


def _pickle(model: Calibration) -> Calibration:
    copy: Calibration = pickle.loads(pickle.dumps(model))
    return copy


def _flatness_fault(undeformed: Quantity, scene: VirtualPress) -> str:
    """Return why a measurement of the undeformed surface is not flat; "" if it is flat."""
    if isinstance(undeformed, Gradients):
        slope = float(np.hypot(undeformed.x, undeformed.y).mean())
        if slope > 0.1:  # mm/mm: 6°
            return f"the undeformed surface has a mean slope of {slope:.2g}"
    if isinstance(undeformed, HeightMap):
        error_mm = float(np.abs(undeformed.mm).mean())
        if error_mm > 0.2 * scene.height_mm.max():
            return f"the undeformed surface has a mean height error of {error_mm:.2g} mm"
    return ""


def _size(frame: Frame) -> str:
    height, width = frame.pixels.shape[:2]
    return f"{width} × {height}"
