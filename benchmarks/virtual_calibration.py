"""Accuracy on unseen virtual objects: ``python benchmarks/virtual_calibration.py``.

Every step is a command of the public CLI. ``tactile simulate`` renders presses of a ball and of
other objects on the same unit, ``tactile calibrate`` fits, and ``tactile run`` measures. The
results are compared with the ground truth. ``--seed`` determines positions, depths, rotations and
the unit. Prints one row per object, and a summary with the target of each rig.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.calibration.presses import PRESS, angles_deg
from tactile_core.cli import main as tactile
from tactile_core.formats.npz import read_npz
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

BALL_SHARE = 0.22
"""Diameter of the calibration ball, in view widths."""


@dataclass(frozen=True)
class Target:
    """Accuracy that one rig with one model has to reach."""

    profile: str
    model: str
    normals_deg: float
    depth_um: float


TARGETS = (
    Target("hex_fingertip", "core.lookup_table", 5.5, 40),
    Target("hex_fingertip", "core.mlp", 3.5, 40),
    Target("baxter_fingertip", "baxter_fingertip.hue_intensity", 6.0, 40),
    Target("baxter_fingertip_marked", "baxter_fingertip.hue_intensity", 6.0, 40),
    Target("desktop_six_led", "desktop_six_led.photometric_stereo", 2.5, 15),
)


@dataclass(frozen=True)
class Trial:
    """One press of one object: its name, and the steps of a script that end with its frame."""

    name: str
    steps: tuple[dict[str, Any], ...]

    @property
    def frames(self) -> int:
        """Number of frames of the steps."""
        return len(self.steps) - 1


@dataclass(frozen=True)
class Score:
    """Accuracy for one object.

    Attributes
    ----------
    normals_deg : float
        Mean angular error over the contact, including its border and markers.
    inner_normals_deg : float
        The same without the outer fifth, as ``tactile calibrate`` scores.
    depth_um : float
        RMS of the height error over the contact, after subtraction of its mean.
    inside_um, image_um : float
        RMS of the height error over the contact, and over the image.
    """

    name: str
    normals_deg: float
    inner_normals_deg: float
    depth_um: float
    inside_um: float
    image_um: float


class Draw:
    """Draws objects and positions at random; sizes are relative to the rig's calibration ball."""

    def __init__(self, profile: Profile, seed: int) -> None:
        image = profile.image
        self._size_mm = np.array([image.width_px, image.height_px]) * image.mm_per_px
        thick_mm = profile.gel.thickness_mm or self._size_mm[0]
        self.ball_mm = round(float(min(BALL_SHARE * self._size_mm[0], 2 * thick_mm)), 2)
        self._rng = np.random.default_rng(seed)

    def pressed(
        self, name: str, depths: tuple[float, float], *then: dict[str, Any], **shape: Any
    ) -> Trial:
        """Press an object; its lengths and depths are in ball diameters."""
        x, y = self._rng.uniform(-0.3, 0.3, 2) * self._size_mm
        kind = {"kind": shape.pop("kind"), "x_mm": float(x), "y_mm": float(y)}
        rotation = {"angle_deg": float(self._rng.uniform(0, 180))}
        sizes = {k: self._in_mm(v) if k.endswith("_mm") else v for k, v in shape.items()}
        depth = float(self._rng.uniform(*depths)) * self.ball_mm
        take = {"indenter": kind | rotation | sizes}
        return Trial(name, (take, {"press": {"depth_mm": depth, "frames": 1}}, *then))

    def _in_mm(self, value: Any) -> Any:
        if isinstance(value, tuple):
            return [round(v * self.ball_mm, 3) for v in value]
        return round(value * self.ball_mm, 3)

    def calibrating(self, count: int) -> list[Trial]:
        """Presses of the calibration ball."""
        return [self.pressed("", (0.1, 0.2), kind="sphere", diameter_mm=1.0) for _ in range(count)]

    def others(self, repeats: int) -> Iterator[Trial]:
        """The calibration ball at new positions, then objects that no calibration has seen."""
        shear = {"shear": {"dx_mm": 0.08 * self.ball_mm, "dy_mm": 0.05 * self.ball_mm, "frames": 1}}
        for _ in range(repeats):
            yield self.pressed("same ball", (0.1, 0.2), kind="sphere", diameter_mm=1.0)
            yield self.pressed("ball 0.7", (0.1, 0.15), kind="sphere", diameter_mm=0.7)
            yield self.pressed("ball 1.6", (0.08, 0.16), kind="sphere", diameter_mm=1.6)
            cylinder = {"kind": "cylinder", "diameter_mm": 1.2, "length_mm": 1.8}
            yield self.pressed("cylinder", (0.08, 0.14), **cylinder)
            yield self.pressed("round punch", (0.05, 0.1), kind="flat", diameter_mm=0.9)
            yield self.pressed("square punch", (0.05, 0.1), kind="flat", size_mm=(1.0, 0.7))
            yield self.pressed("cone", (0.08, 0.14), kind="cone", diameter_mm=1.4)
            yield self.pressed("sheared ball", (0.1, 0.16), shear, kind="sphere", diameter_mm=1.3)


def command(*words: str) -> str:
    """Run ``tactile WORDS``; return its standard output."""
    printed, errors = StringIO(), StringIO()
    with redirect_stdout(printed), redirect_stderr(errors):
        try:
            tactile(list(words))
        except SystemExit as end:
            code = end.code
    if code:
        sys.exit(f"tactile {' '.join(words)}: {errors.getvalue()}")
    return printed.getvalue()


def simulated(profile: str, trials: list[Trial], out: Path, seed: int) -> None:
    """Play trials in sequence; the object is released after each."""
    steps = [step for trial in trials for step in (*trial.steps, {"release": {}})]
    script = out.with_suffix(".yaml")
    script.write_text(json.dumps({"steps": steps}))
    command("simulate", profile, "--script", str(script), "--out", str(out), "--seed", str(seed))


def compared(name: str, result: Path, truth: Path) -> Score:
    """Score the results of one frame."""
    from scipy.ndimage import distance_transform_edt

    measured_arrays, true = read_npz(result), read_npz(truth)
    contact = true["contact"]
    depth = distance_transform_edt(contact)
    inner = depth > (1 - PRESS.scored_contact_share) * depth.max()
    error_um = 1e3 * (measured_arrays["height_mm"] - true["height_mm"])
    gradients = measured_arrays["gradients"]

    def normals(mask: NDArray[np.bool_]) -> float:
        return float(angles_deg(gradients[mask], true["gradients"][mask]).mean())

    def rms(values: NDArray[Any]) -> float:
        return float(np.sqrt(np.mean(values**2)))

    inside = error_um[contact]
    return Score(
        name, normals(contact), normals(inner), float(inside.std()), rms(inside), rms(error_um)
    )


def measured(target: Target, folder: Path, presses: int, repeats: int, seed: int) -> list[Score]:
    """Calibrate one model of one rig, and measure all objects."""
    draw = Draw(load_profile(target.profile), seed)
    ball, other = folder / f"{target.profile}_ball", folder / f"{target.profile}_other"
    trained, trials = draw.calibrating(presses), list(draw.others(repeats))
    if not ball.exists():
        simulated(target.profile, trained, ball, seed)
        simulated(target.profile, trials, other, seed)
    bundle, results = folder / f"{target.model}_bundle", folder / f"{target.model}_results"
    reference = ("--reference", str(ball / "reference"))
    printed = command(
        *("calibrate", target.profile, "--presses", str(ball / "frames"), *reference),
        *("--ball-diameter-mm", str(draw.ball_mm), "--model", target.model),
        *("--out", str(bundle), "--json"),
    )
    report = json.loads(printed)
    used = sum(press["used"] for press in report["presses"])
    held_out = report["held_out"]["normal_error_deg"]["mean"]
    print(f"{target.profile} {target.model}: used {used} frames; there are {presses} presses")
    print(f"  held-out error by 'tactile calibrate': {held_out:.2f}°")
    command(
        *("run", target.profile, "--input", str(other / "frames"), *reference),
        *("--bundle", str(bundle), "--out", str(results)),
    )
    scores, number = [], 0
    for trial in trials:
        number += trial.frames
        name = f"{number:06d}.npz"
        scores.append(compared(trial.name, results / name, other / "truth" / name))
        number += 1
    return scores


def averaged(scores: list[Score]) -> Iterator[Score]:
    """One score per object."""
    for name in dict.fromkeys(score.name for score in scores):
        rows = [tuple(vars(s).values())[1:] for s in scores if s.name == name]
        yield Score(name, *np.mean(rows, axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", choices=sorted({target.profile for target in TARGETS}))
    parser.add_argument("--presses", type=int, default=18)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    head = f"  {'':14}{'normals':>9}{'inner':>8}{'depth':>9}{'in contact':>12}{'image':>9}"
    summary = []
    with TemporaryDirectory(prefix="virtual-calibration-") as name:
        for target in TARGETS:
            if options.rig not in (None, target.profile):
                continue
            count = (options.presses, options.repeats, options.seed)
            scores = list(averaged(measured(target, Path(name), *count)))
            print(head)
            for s in scores:
                print(
                    f"  {s.name:14}{s.normals_deg:8.2f}°{s.inner_normals_deg:7.2f}°"
                    f"{s.depth_um:6.0f} µm{s.inside_um:9.0f} µm{s.image_um:6.0f} µm",
                    flush=True,
                )
            mean = np.mean([[s.normals_deg, s.inside_um] for s in scores], axis=0)
            summary.append(
                f"{target.profile:25}{target.model:36}"
                f"{mean[0]:6.2f}° of {target.normals_deg:g}°"
                f"{mean[1]:8.0f} of {target.depth_um:g} µm"
            )
    print("\n".join(["", "mean over objects, whole contact; measured of target:", *summary]))


if __name__ == "__main__":
    main()
