"""Calibrations of other programs, and ours written for Taxim, on recordings of their sensors.

``python -m experiments.imported_calibrations [DATA]``. A GelSight Mini and a ball: our calibration
on every other press, the network that gelslam's authors trained for this Mini, Taxim's table of
another Mini, and our calibration as such a table, all on the presses between. How well that table
predicts the colours of these presses. A 9DTact sensor: the sphere through its only press.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from experiments.press_sets import ROOT, SETS
from experiments.presses import calibrated
from experiments.sphere import radius_px
from tactile_9dtact.depth_table import DepthTableImporter
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.imported import import_calibration
from tactile_core.calibration.press_search import find_presses, light_of, relocate_press
from tactile_core.calibration.presses import FoundPress, angles_deg
from tactile_core.cli.output import table_lines
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference
from tactile_imports.polynomial_table import PolynomialTable, place_terms, write_table
from tactile_imports.table_of_bundle import table_of

MINI = next(each for each in SETS if each.name == "gelsight_mini")
NINEDTACT = """\
schema: 1
name: ninedtact
image: {width_px: 640, height_px: 480, mm_per_px: 0.05102}
illumination: {use: core.constant}
calibration: {use: core.automatic}
estimators: {height: {use: core.poisson}}
"""
PRESSED = 0.3  # [share of the peak] What counts as the contact of 9DTact's ball

Presses = Sequence[tuple[Frame, FoundPress]]


def main() -> None:
    """Print what is measured."""
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT.parent / "shared" / "data"
    folder, calibrations = data / MINI.folder, data / "calibrations"
    files = sorted(folder.glob(MINI.pattern))
    own = calibrated(folder, MINI, files[::2], None, scored=False)
    seen = [press for press in own.presses if isinstance(press, FoundPress) and press.used]
    reference = own.bundle.reference
    assert reference is not None
    pipeline = Pipeline(MINI.profile, own.bundle)
    presses = []
    for file in files[1::2]:
        frame = next(iter(read_frames(pipeline.profile, file)))
        conditioned = pipeline.process(frame).frame
        (start,) = find_presses([file.name], [conditioned], reference, seen[0].ball_radius_px)
        presses.append((frame, relocate_press(start, light_of(seen))))
    table = table_of(own.bundle)
    with tempfile.TemporaryDirectory() as temporary:
        exported = Path(temporary) / "polycalib.npz"
        write_table(exported, table, "bgr")
        rows = [scored("tactile calibrate", own.bundle, reference, presses)]
        for name, file, kind in (
            ("gelslam's network", calibrations / "gelslam_mini_nnmodel.pth", "gs_sdk"),
            ("Taxim's table, another Mini", calibrations / "taxim_mini_polycalib.npz", "taxim"),
            ("tactile export --as taxim", exported, "taxim"),
        ):
            bundle = import_calibration(file, f"imports.{kind}", MINI.profile)
            rows.append(scored(name, bundle, reference, presses))
        print("\n".join(table_lines(["", "normals", "predict flat", "sphere / ball"], rows)))
        print(f"colours of these presses, red, green, blue: {predicted(table, reference, presses)}")
        nine = Path(temporary) / "ninedtact.yaml"
        nine.write_text(NINEDTACT)
        print(f"9DTact: sphere of {ninedtact_mm(nine, data / 'ninedtact' / 'sensor_1'):.2f} mm")


def scored(name: str, bundle: Bundle, reference: Reference, presses: Presses) -> list[str]:
    """Return the errors of the normals, those of flat gel, and the radius of the spheres."""
    pipeline = Pipeline(MINI.profile, bundle, reference)
    errors, flat, spheres = [], [], []
    for frame, press in presses:
        reading = pipeline.process(frame)
        errors.append(press.normal_errors_deg(reading[Gradients]))
        true = press.true_gradients(press.scored_area())[2]
        flat.append(angles_deg(np.zeros_like(true), true))
        spheres.append(radius_px(reading[HeightMap], press) / press.ball_radius_px)
    means = (f"{np.concatenate(angles).mean():.2f}°" for angles in (errors, flat))
    return [name, *means, f"{np.median(spheres):.3f}"]


def predicted(table: PolynomialTable, reference: Reference, presses: Presses) -> str:
    """Return the correlations of observed and rendered changes of colour in the contacts."""
    steps = table.bins - 1
    pairs = []
    for frame, press in presses:
        y, x, slopes = press.true_gradients(press.scored_area())
        tilt = np.arctan(np.hypot(*slopes.T)) / (np.pi / 2)
        direction = (np.arctan2(slopes[:, 1], slopes[:, 0]) + np.pi) / (2 * np.pi)
        at = (tilt * steps).astype(int), (direction * steps).astype(int)
        rendered = np.einsum("nct,nt->nc", table.coefficients[at], place_terms(x, y))
        observed = frame.pixels[y, x] - reference.pixels[y, x]
        pairs.append(np.stack([rendered, observed]))
    both = np.concatenate(pairs, axis=1)
    return ", ".join(f"{np.corrcoef(both[0, :, k], both[1, :, k])[0, 1]:.2f}" for k in range(3))


def ninedtact_mm(profile: Path, folder: Path) -> float:
    """Return the radius of the sphere through the contact of the sensor's press."""
    build = load_profile(profile)
    model = DepthTableImporter().read(folder, build)
    pictures = folder / "depth_calibration"
    (frame,) = read_frames(build, pictures / "sample.png")
    (undeformed,) = read_frames(build, pictures / "ref.png")
    reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)
    mm = model.measure(frame, reference).mm
    y, x = np.nonzero(mm > PRESSED * mm.max())
    points = np.column_stack([x * frame.mm_per_px, y * frame.mm_per_px, mm[y, x]])
    # x² + y² + z² of a sphere is linear in x, y and z
    terms = np.column_stack([points, np.ones(len(points))])
    solved = np.linalg.lstsq(terms, (points**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(solved[3] + ((solved[:3] / 2) ** 2).sum()))


if __name__ == "__main__":
    main()
