"""Simulations on disk: frames with their ground truth, and presses for a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.folders import fresh_folder, move_in, resolve_links
from tactile_core.formats.images import write_png
from tactile_core.formats.npz import write_npz
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.illumination import COLOUR
from tactile_core.interfaces.simulator import Renderer, Simulator
from tactile_core.quantities import Frame
from tactile_sim.optics.rig import RigOptics
from tactile_sim.script import Script
from tactile_sim.stage import VirtualStage
from tactile_sim.truth import TrueState

FRAMES, TRUTH, REFERENCE = "frames", "truth", "reference"


def simulate(
    stage: VirtualStage, script: Script, out: Path, *, progress: Progress | None = None
) -> int:
    """Play a script on a stage and write its frames and ground truth, all or nothing.

    ``out/frames`` is a recording and ``out/reference`` a recording of the undeformed sensor.
    ``out/truth/NAME.npz`` holds the ground truth of each frame under the names that ``tactile run``
    uses, and in addition ``stick``, ``time_s``, ``depth_mm`` and ``pose`` (x and y of the object in
    mm, and its angle in degrees). Dense fields refer to current image positions.

    Parameters
    ----------
    stage : VirtualStage
        It is reset first.
    script : Script
    out : Path
        A folder that does not exist or is empty.
    progress : Progress, optional

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    InputError
        A step of the script is impossible, or the folder is not empty.
    OSError
        Writing failed, for example because the disk is full; no files are left behind.
    """
    progress = progress or Silent()
    folder = resolve_links(Path(out))
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{out} already exists; give another --out, or empty it")
    progress.stage("simulating", 1.0)
    with fresh_folder(folder) as fresh:
        stage.reset()
        (fresh / TRUTH).mkdir()
        write_frame(fresh / REFERENCE, stage.frame(), "undeformed")
        for number, _ in enumerate(script.play_frames(stage)):
            name = f"{number:06d}"
            write_frame(fresh / FRAMES, stage.frame(), name)
            write_npz(fresh / TRUTH / f"{name}.npz", truth_arrays(stage.truth()))
            progress.fraction((number + 1) / script.frames)
        move_in(fresh, folder)
    return script.frames


def truth_arrays(truth: TrueState) -> Mapping[str, NDArray[Any]]:
    """Arrays of the ground truth, under the names of the measured quantities."""
    return {
        "height_mm": truth.height_mm,
        "gradients": truth.gradients,
        "contact": truth.contact,
        "stick": truth.stick,
        "displacement_mm": truth.displacement_mm,
        "markers_px": truth.markers_px.astype(np.float32),
        "wrench": truth.wrench.astype(np.float32),
        "mm_per_px": np.array(truth.mm_per_px),
        "time_s": np.array(truth.time_s),
        "depth_mm": np.array(truth.depth_mm),
        "pose": np.array([truth.pose.x_mm, truth.pose.y_mm, truth.pose.angle_deg]),
    }


def write_frame(folder: Path, frame: Frame, name: str) -> None:
    """Write a colour image, or a folder of grey images, one per light of a sequence."""
    pixels = frame.pixels
    sequential = len(frame.exposure_times_s) > 1 or pixels.shape[2] not in (1, COLOUR)
    inside = folder / name if sequential else folder
    inside.mkdir(parents=True, exist_ok=True)
    if not sequential:
        write_png(folder / f"{name}.png", pixels[..., 0] if pixels.shape[2] == 1 else pixels)
        return
    for k in range(pixels.shape[2]):
        write_png(inside / f"{k:02d}.png", np.ascontiguousarray(pixels[..., k]))


class VirtualUnits(Simulator):
    """Renders height maps, and presses balls into virtual gels."""

    def renderer(self, build: SensorBuild, *, seed: int = 0) -> Renderer:
        """Return the optics of a unit."""
        return RigOptics(build, seed=seed)

    def write_presses(self, build: SensorBuild, folder: Path, *, count: int) -> float:
        """Press a ball at random places of the image, not too near its border."""
        return press_balls(VirtualStage(build), folder, count=count)

    def write_script(self, build: SensorBuild, path: Path, *, ball_diameter_mm: float) -> None:
        """Press a ball twice at each of twelve places, from shallow to deep."""
        path.write_text(guided_script(build, ball_diameter_mm), encoding="utf-8")


def guided_script(build: SensorBuild, ball_mm: float) -> str:
    """Return the YAML of a :class:`~tactile_sim.script.Script` for a guided calibration."""
    width_mm, height_mm = (
        side * build.image.mm_per_px for side in (build.image.width_px, build.image.height_px)
    )
    places = [(x, y) for y in (-0.3, 0.0, 0.3) for x in (-0.32, -0.11, 0.11, 0.32)]  # views
    order = np.random.default_rng(0).permutation(2 * len(places))
    ball = f"  - indenter: {{kind: sphere, diameter_mm: {ball_mm:g}"
    lines = ["steps:", f"{ball}}}", "  - hold: {seconds: 1, frames: 30}"]
    for number, chosen in enumerate(order):
        x, y = places[chosen % len(places)]
        depth_mm = ball_mm * (0.13 + 0.08 * number / len(order))
        lines += [
            f"{ball}, x_mm: {x * width_mm:.3f}, y_mm: {y * height_mm:.3f}}}",
            f"  - press: {{depth_mm: {depth_mm:.3f}, frames: 3}}",
            "  - hold: {seconds: 0.4, frames: 12}",
            "  - release: {seconds: 1}",
            "  - hold: {seconds: 0.2, frames: 6}",
        ]
    return "\n".join(lines) + "\n"


def press_balls(stage: VirtualStage, folder: Path, *, count: int) -> float:
    """Press a ball repeatedly; write ``folder/presses`` and ``folder/reference``.

    Returns
    -------
    float
        Diameter of the ball, mm.
    """
    rng = np.random.default_rng(7)
    diameter_mm = ball_diameter_mm(stage.profile)
    write_frame(folder / "reference", stage.frame(), "undeformed")
    for number in range(count):
        x, y = rng.uniform(-0.38, 0.38, 2)  # shares of the image
        depth_mm = float(rng.uniform(0.12, 0.22)) * diameter_mm
        put_object(stage, "sphere", float(x), float(y), diameter_mm=diameter_mm)
        stage.press(depth_mm=depth_mm)
        write_frame(folder / "presses", stage.frame(), f"press_{number:02d}")
    return diameter_mm


def put_object(
    stage: VirtualStage, kind: str, x: float, y: float, angle_deg: float = 0.0, **sizes_mm: float
) -> None:
    """Place an object over an undeformed gel; x and y are shares of the image from its centre."""
    image = stage.profile.image
    stage.reset()
    stage.indenter(
        kind,
        x_mm=x * image.width_px * image.mm_per_px,
        y_mm=y * image.height_px * image.mm_per_px,
        angle_deg=angle_deg,
        **sizes_mm,
    )


def ball_diameter_mm(build: SensorBuild) -> float:
    """Return the diameter of a ball for the calibration of a sensor, mm."""
    view_mm = build.image.width_px * build.image.mm_per_px
    most_mm = 2 * (build.gel.thickness_mm or view_mm)  # a larger ball reaches through the gel
    return round(min(0.22 * view_mm, most_mm), 2)
