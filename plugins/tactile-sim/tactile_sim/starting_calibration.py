"""Starting calibrations: they measure each unit of a design coarsely before it is calibrated."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactile_core.bundles.bundle import Bundle, manifest_for
from tactile_core.bundles.manifest import ERRORS, LIGHT, Starting, read_manifest
from tactile_core.bundles.places import check_place
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.light_range import thickness_of
from tactile_core.calibration.presses import FoundPress
from tactile_core.calibration.result import Calibrated, Fold
from tactile_core.calibration.score import Score
from tactile_core.calibration.scoring import CrossValidation, Trials, measured_fold
from tactile_core.errors import CalibrationError, InputError
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.calibration import Calibration, Progress, Silent
from tactile_core.interfaces.slope_models.slope_model import SlopeCalibration
from tactile_core.plugins.options import calibrator_of, fitted_by
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_sim.simulation import press_balls
from tactile_sim.stage import VirtualStage, vary

PRESSES = 12  # [count] Of each virtual unit

_LEVEL = 0.5  # [full scale] Brightness of the undeformed gel; models see relative changes alone


@dataclass(frozen=True, eq=False)
class StartingCalibration:
    """A bundle for all units of a design, and how it measures units that it has not seen.

    Attributes
    ----------
    bundle : Bundle
        Without a reference: each unit gives its own.
    score : Score
        Of presses of each unit, by calibrations on the other ones.
    """

    bundle: Bundle
    score: Score

    def describe(self) -> str:
        """Say what it was fitted to, and how it measures a unit that it has not seen."""
        manifest, score = self.bundle.manifest, self.score
        starting = manifest.starting
        assert starting is not None
        radii = score.sphere_quartiles() or (np.nan, np.nan, np.nan)
        return (
            f"fitted to {manifest.presses_used} presses of a ball on {starting.of}; on one "
            f"that it has not seen, normals are off by {score.mean_deg:.1f}° in the mean "
            f"({score.predict_flat_deg:.1f}° if all were level) and spheres have {radii[1]:.2f} of "
            f"the ball's radius (quartiles {radii[0]:.2f} and {radii[2]:.2f})"
        )

    def save(self, folder: Path) -> None:
        """Write the bundle with its data sheet, as :meth:`Bundle.save` does."""
        name = self.bundle.manifest.profile
        sheet = (
            f"Starting calibration of {name}\n\n"
            "Measures any unit of this design coarsely, relative to its first image, until it is "
            "calibrated. Not for what depends on depth.\n\n"
            f"- Data: {self.describe()}. Real units may differ more than virtual ones do.\n"
            f"- Made with: tactile starting-calibration {name}.\n"
            "- Licence: that of the package it is in.\n"
        )

        def write_sheet(fresh: Path) -> None:
            (fresh / "data_sheet.txt").write_text(sheet, encoding="utf-8")

        self.bundle.save(folder, write_sheet)


def starting_calibration(
    name: str | Path,
    *,
    units: int = 15,
    measured: Calibrated | None = None,
    progress: Progress | None = None,
) -> StartingCalibration:
    """Fit the calibrator of a profile to presses of many units of its design.

    Units differ in light, coating, gel and camera, so that the model is that of a typical unit.
    Each image is taken relative to the undeformed gel of its unit.

    Parameters
    ----------
    name : str or Path
        The profile.
    units : int
        Number of virtual units, at least 5; see :func:`~tactile_sim.stage.vary`.
    measured : Calibrated, optional
        Presses of a real unit, which count as those of one more.
    progress : Progress, optional

    Raises
    ------
    TactileError
        The profile cannot be simulated, or its presses not be fitted.
    """
    progress = progress or Silent()
    profile, design = load_profile(name), load_profile(name, sim=True)
    calibrator = calibrator_of(profile.calibration)
    if calibrator.refusal:
        raise CalibrationError(calibrator.refusal)
    if calibrator.fits == "heights":
        raise CalibrationError(
            f"a starting calibration measures slopes, and that of {profile.name} would measure "
            f"heights; leave 'starting_bundle' out of the profile"
        )
    progress.stage("pressing virtual units", 0.6)
    groups = []
    for number in range(1, units + 1):
        groups.append(_relative_presses(_pressed_unit(design, number)))
        progress.fraction(number / units)
    if measured is not None:
        groups.append(_relative_presses(measured))
    presses = [press for group in groups for press in group]
    if not presses:
        raise CalibrationError(f"no virtual press of {profile.name} can be used")
    reference = _uniform(presses[0].frame)
    trials = Trials(
        presses,
        partial(_without, presses, reference),
        reference,
        partial(fitted_by, calibrator),
        thickness_of(profile),
    )
    ends = np.cumsum([len(group) for group in groups])
    unit_by_unit = [range(e - len(group), e) for e, group in zip(ends, groups, strict=True)]
    progress.stage("fitting, and scoring on each unit by the others", 0.4)
    results = []
    for unit in unit_by_unit:
        results.append(measured_fold(trials, unit))
        progress.fraction(len(results) / len(unit_by_unit))
    score = CrossValidation(trials, unit_by_unit, []).score(results)
    assert score is not None
    assert score.errors is not None
    artefacts: dict[str, Artefact] = {LIGHT: _small(trials.fit_all()), ERRORS: score.errors}
    real = "" if measured is None else " and a real one"
    manifest = manifest_for(
        profile,
        reference.channels,
        artefacts,
        presses_used=len(presses),
        held_out=score.summary(),
        starting=Starting(
            of=f"{units} virtual units of {profile.name}{real}",
            flip=profile.image.flip,
            rotate_deg=profile.image.rotate_deg,
        ),
    )
    return StartingCalibration(Bundle(manifest, artefacts, None), score)


def check_starting_place(folder: Path) -> None:
    """Check that a starting calibration may be written to a folder.

    Raises
    ------
    InputError
        It holds anything else, such as the bundle of a unit.
    """
    place = check_place(folder)
    if place.exists() and any(place.iterdir()) and not read_manifest(place).starting:
        raise InputError(f"{folder} is the bundle of a unit; name another --out folder")


def _pressed_unit(design: Profile, number: int) -> Calibrated:
    unit = vary(design, number)
    with TemporaryDirectory(prefix="tactile-unit-") as name:
        folder = Path(name)
        ball_mm = press_balls(VirtualStage(unit, number), folder, count=PRESSES)
        return calibrate(
            unit,
            folder / "presses",
            folder / "reference",
            ball_diameter_mm=ball_mm,
            scored=False,
        )


def _relative_presses(unit: Calibrated) -> list[FoundPress]:
    """Return the presses of a unit as they are on an undeformed gel of uniform brightness."""
    undeformed = unit.bundle.reference
    assert undeformed is not None
    moved = []
    for press in unit.presses:
        if not isinstance(press, FoundPress) or not press.used:
            continue
        frame, dark = press.frame, np.float32(1e-3 * undeformed.full_scale)
        ratio = frame.pixels / np.maximum(undeformed.pixels, dark)
        masks = [m for m in (frame.marker_mask, undeformed.marker_mask) if m is not None]
        relative = replace(
            frame,
            pixels=np.float32(_LEVEL * frame.full_scale) * ratio,
            marker_mask=np.logical_or.reduce(masks) if masks else None,
            marker_contrast=None,
        )
        moved.append(replace(press, frame=relative))
    return moved


def _uniform(frame: Frame) -> Reference:
    pixels = np.full(frame.pixels.shape, _LEVEL * frame.full_scale, np.float32)
    return Reference(pixels, frame.channels, frame.full_scale)


def _without(
    presses: Sequence[FoundPress], reference: Reference, held_out: Collection[int]
) -> Fold[FoundPress]:
    seen = [press for i, press in enumerate(presses) if i not in held_out]
    return Fold(seen, reference, presses.__getitem__)


def _small(model: Calibration) -> Calibration:
    """Return a model without the table that only saves time."""
    if not isinstance(model, SlopeCalibration):
        return model
    return type(model)(replace(model.slopes, table=None))
