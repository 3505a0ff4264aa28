"""Valid inputs of every kind, small enough for commands of a tenth of a second."""

from __future__ import annotations

import shutil
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.fitting import calibrate
from tactile_core.formats.tmd import write_tmd
from tactile_core.pipeline.conversion import convert, keep_recording
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.optics.rig import render
from tactile_sim.script import Script
from tactile_sim.simulation import simulate
from tactile_sim.stage import VirtualStage

WIDTH, HEIGHT, SCALE_MM, BALL_MM = 80, 60, 0.1, 3.0
SHAPE = (HEIGHT, WIDTH)
_IMAGE = f"{{width_px: {WIDTH}, height_px: {HEIGHT}, mm_per_px: {SCALE_MM}}}"
_LIGHTS = """\
  lights:
    - {name: red, azimuth_deg: 90, elevation_deg: 35}
    - {name: green, azimuth_deg: 210, elevation_deg: 35}
    - {name: blue, azimuth_deg: 330, elevation_deg: 35}
optics:
  lights: {distance_mm: 40, scatter: 1.0}
  sensor: {jpeg_quality: none}
"""
_STEPS = "estimators: {height: {use: core.poisson}, contact: {use: core.contact}}\n"

PROFILES = {
    "small": f"schema: 1\nname: small\nimage: {_IMAGE}\nillumination:\n  use: core.constant\n"
    f"{_LIGHTS}calibration: {{use: core.polynomial}}\n{_STEPS}",
    "turn": f"schema: 1\nname: turn\nimage: {_IMAGE[:-1]}, color: grey}}\n"
    f"camera: {{use: core.replay}}\nillumination:\n  use: core.sequential\n{_LIGHTS}"
    "calibration: {use: core.polynomial, blur_px: 1}\nestimators: {height: {use: core.poisson}}\n",
    "marked": f"schema: 1\nname: marked\nextends: small.yaml\nimage: {_IMAGE}\n"
    "gel: {markers: {pitch_mm: 1.1, diameter_mm: 0.4}}\nestimators:\n"
    "  markers: {use: core.markers}\n  tracking: {use: core.marker_tracking}\n"
    "  displacement: {use: core.displacement}\n"
    "  slip_contact: {use: core.slip_contact}\n  shear: {use: core.contact_shear}\n"
    "  imprint: {use: core.imprint_motion}\n"
    "  slip: {use: core.slip}\n",
    "lit": "schema: 1\nname: lit\nextends: small.yaml\noptics:\n"
    "  lights: {distance_mm: 14, scatter: 0.3}\n"
    "  sensor: {white_balance: [1.0, 0.8, 0.6], vignetting: 0.2}\n",
    "touched": "schema: 1\nname: touched\nextends: small.yaml\ncamera: {use: core.replay}\n"
    "calibration: {use: core.lookup_table}\nestimators: {height: {use: core.robust_poisson}}\n"
    "sim: {}\n",
}
SCRIPT = """\
steps:
  - indenter: {kind: sphere, diameter_mm: 3, x_mm: 0.2}
  - press: {depth_mm: 0.3, frames: 2}
  - shear: {dx_mm: 0.1, frames: 1}
  - twist: {degrees: 2, frames: 1}
  - hold: {seconds: 0.1, frames: 1}
  - release: {}
"""
LABELS = """\
file,centre_x_px,centre_y_px,contact_radius_px
press_0.png,25,25,11
press_1.png,55,30,11
press_2.png,30,38,11
press_3.png,50,22,11
"""
_CENTRES = ((25.0, 25.0), (55.0, 30.0), (30.0, 38.0), (50.0, 22.0))
_BLOCK = """\
solid block
facet normal 0 0 -1
outer loop
vertex -1 -1 0
vertex 1 -1 0
vertex 0 1 0
endloop
endfacet
endsolid block
"""


def make_corpus(folder: Path) -> Path:
    """Write profiles, recordings, targets, bundles, scripts and truths; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in PROFILES.items():
        (folder / f"{name}.yaml").write_text(text)
    (folder / "script.yaml").write_text(SCRIPT)
    (folder / "labels.csv").write_text(LABELS)
    (folder / "block.stl").write_text(_BLOCK)
    small, turn = load_profile(folder / "small.yaml"), load_profile(folder / "turn.yaml")
    presses = [BallPress(centre, BALL_MM, 0.5) for centre in _CENTRES]
    for k, press in enumerate(presses):
        _save(small, folder / "presses" / f"press_{k}.png", _depth(press), k)
    _save(small, folder / "ref.png", np.zeros(SHAPE), 9)
    _save(small, folder / "frames" / "ball.png", _depth(BallPress((42, 30), 2.5, 0.4)), 10)
    _save(small, folder / "frames" / "rest.png", np.zeros(SHAPE), 11)
    _save(small, folder / "frame.jpg", _depth(presses[0]), 12)
    _film(folder / "film.avi", sorted((folder / "presses").iterdir()))
    _grid(small, folder)
    _sequential_scans(turn, folder)
    calibrate(
        small, folder / "presses", folder / "ref.png", ball_diameter_mm=BALL_MM, serial="0007"
    ).save(folder / "bundle")
    calibrate(turn, folder / "scan", folder / "level", target=folder / "map.tmd").save(
        folder / "turn_bundle"
    )
    _uneven_light(folder)
    _tapes(small, folder)
    simulate(VirtualStage(small, 0, "fast"), Script(folder / "script.yaml"), folder / "played")
    marked = load_profile(folder / "marked.yaml")
    simulate(VirtualStage(marked, 0, "fast"), Script(folder / "script.yaml"), folder / "sheared")
    return folder


def _uneven_light(folder: Path) -> None:
    """Write a sensor whose reference differs from itself turned, mirrored or in other channels."""
    lit = load_profile(folder / "lit.yaml")
    for k, centre in enumerate(_CENTRES):
        press = BallPress(centre, BALL_MM, 0.5)
        _save(lit, folder / "lit" / "presses" / f"press_{k}.png", _depth(press), k)
    _save(lit, folder / "lit.png", np.zeros(SHAPE), 9)
    calibrate(lit, folder / "lit" / "presses", folder / "lit.png", ball_diameter_mm=BALL_MM).save(
        folder / "lit_bundle"
    )


def _tapes(profile: Profile, folder: Path) -> None:
    """Write a recording in each format, and one that was cut off."""
    for name in ("tape.mcap", "tape"):
        given = {"bundle": folder / "bundle", "input": folder / "presses"}
        with (
            open_sensor(profile, reference=folder / "ref.png", **given) as sensor,
            sensor.record(folder / name) as recording,
        ):
            for _ in keep_recording(sensor, recording):
                pass
    convert(folder / "tape.mcap", folder / "tape.h5")
    data = (folder / "tape.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(data[: len(data) * 9 // 10])


def _depth(press: BallPress) -> NDArray[np.float64]:
    return np.asarray(press.height_mm(SHAPE, SCALE_MM), float)


def _save(profile: Profile, path: Path, height_mm: NDArray[np.float64], seed: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), render(profile, height_mm, seed=seed)[..., ::-1])


def _film(path: Path, images: list[Path]) -> None:
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (WIDTH, HEIGHT), isColor=True
    )
    for image in images:
        writer.write(cv2.imread(str(image)))
    writer.release()


def _grid(profile: Profile, folder: Path) -> None:
    """Write an image of six balls of the same radius, and the target with their positions."""
    x, y = np.arange(WIDTH), np.arange(HEIGHT)[:, None]
    height, lines = np.zeros(SHAPE), ["type: bga", "radius: 0.8", "pitch: 2", "shapes:"]
    for gx in range(3):
        for gy in range(2):
            cx, cy = 20 + 20 * gx, 20 + 20 * gy
            square = np.maximum(0.64 - SCALE_MM**2 * ((x - cx) ** 2 + (y - cy) ** 2), 0)
            height = np.maximum(height, np.sqrt(square) - 0.3)
            lines.append(f"  - {{type: GridCircle, gx: {gx}, gy: {gy}, r: 8, x: {cx}, y: {cy}}}")
    _save(profile, folder / "balls.png", height, 13)
    (folder / "grid.yaml").write_text("\n".join(lines) + "\n")


def _sequential_scans(profile: Profile, folder: Path) -> None:
    """Write scans of a relief under sequential lights, and its height map."""
    x, y = np.arange(WIDTH) * SCALE_MM, np.arange(HEIGHT)[:, None] * SCALE_MM
    relief = np.zeros(SHAPE)
    for middle, width, depth in ((1.5, 0.5, 0.2), (4.0, 0.4, 0.1), (6.5, 0.5, 0.25)):
        relief -= depth * np.exp(-(((x - middle - 0.3 * np.sin(1.5 * y + middle)) / width) ** 2))
    for name, height, seed in (("scan", relief, 1), ("level", 0 * relief, 2)):
        place = folder / name
        place.mkdir()
        exposures = np.moveaxis(render(profile, height, seed=seed), -1, 0)
        for k, exposure in enumerate(exposures):
            cv2.imwrite(str(place / f"light{k}.png"), exposure)
        (place / "scan.yaml").write_text(
            f"images: [{', '.join(f'light{k}.png' for k in range(len(exposures)))}]\n"
            f"guid: abc\nmmperpixel: {SCALE_MM}\ncrop: [0, 0, {WIDTH}, {HEIGHT}]\n"
            "annotations: []\nmetadata: {gelid: g1}\n"
        )
    for name in ("one", "two"):
        shutil.copytree(folder / "scan", folder / "scans" / name)
    write_tmd(folder / "map.tmd", relief.astype(np.float32), SCALE_MM)
