"""Calibrate on virtual presses, measure other things: ``python benchmarks/virtual_calibration.py``.

Every step is a command that anybody can type: ``tactile simulate`` makes the presses of a ball and
then those of other objects on the same unit, ``tactile calibrate`` fits, ``tactile run`` measures,
and what it writes is compared with the truth beside the frames. Places, depths and turns are drawn
from ``--seed``, which also makes the unit. Prints one row per object, and a summary with what is
asked of each rig.
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
"""Diameter of the calibrating ball, of the width of the view."""


@dataclass(frozen=True)
class Asked:
    """One rig with one model, and what it has to reach."""

    profile: str
    model: str
    normals_deg: float
    depth_um: float


ASKED = (
    Asked("hex_fingertip", "core.lookup_table", 5.5, 40),
    Asked("hex_fingertip", "core.mlp", 3.5, 40),
    Asked("baxter_fingertip", "baxter_fingertip.hue_intensity", 6.0, 40),
    Asked("baxter_fingertip_marked", "baxter_fingertip.hue_intensity", 6.0, 40),
    Asked("desktop_six_led", "desktop_six_led.photometric_stereo", 2.5, 15),
)


@dataclass(frozen=True)
class Trial:
    """One object pressed once: its name, and the steps of a script that end with its frame."""

    name: str
    steps: tuple[dict[str, Any], ...]

    @property
    def frames(self) -> int:
        """How many frames the steps give."""
        return len(self.steps) - 1


@dataclass(frozen=True)
class Score:
    """How one object was measured.

    Attributes
    ----------
    normals_deg : float
        Mean angle over the contact, border and hidden skin under markers included.
    inner_normals_deg : float
        The same without the outer fifth, as ``tactile calibrate`` scores.
    depth_um, inside_um, image_um : float
        RMS of the height over the contact, less the mean error there; as it is; and over the image.
    """

    name: str
    normals_deg: float
    inner_normals_deg: float
    depth_um: float
    inside_um: float
    image_um: float


class Draw:
    """Objects at random places, as large as a calibrating ball of this rig is."""

    def __init__(self, profile: Profile, seed: int) -> None:
        image = profile.image
        self._size_mm = np.array([image.width_px, image.height_px]) * image.mm_per_px
        thick_mm = profile.gel.thickness_mm or self._size_mm[0]
        self.ball_mm = round(float(min(BALL_SHARE * self._size_mm[0], 2 * thick_mm)), 2)
        self._rng = np.random.default_rng(seed)

    def pressed(
        self, name: str, depths: tuple[float, float], *then: dict[str, Any], **shape: Any
    ) -> Trial:
        """Press something; lengths of the shape and depths are in diameters of the ball."""
        x, y = self._rng.uniform(-0.3, 0.3, 2) * self._size_mm
        kind = {"kind": shape.pop("kind"), "x_mm": float(x), "y_mm": float(y)}
        turn = {"angle_deg": float(self._rng.uniform(0, 180))}
        sizes = {k: self._in_mm(v) if k.endswith("_mm") else v for k, v in shape.items()}
        depth = float(self._rng.uniform(*depths)) * self.ball_mm
        steps = ({"indenter": kind | turn | sizes}, {"press": {"depth_mm": depth, "frames": 1}})
        return Trial(name, (*steps, *then))

    def _in_mm(self, value: Any) -> Any:
        if isinstance(value, tuple):
            return [round(v * self.ball_mm, 3) for v in value]
        return round(value * self.ball_mm, 3)

    def calibrating(self, count: int) -> list[Trial]:
        """Presses of the ball."""
        return [self.pressed("", (0.1, 0.2), kind="sphere", diameter_mm=1.0) for _ in range(count)]

    def others(self, repeats: int) -> Iterator[Trial]:
        """Things that no calibration has seen, the ball itself first."""
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
    """Type ``tactile WORDS``; return what it prints."""
    printed, said = StringIO(), StringIO()
    with redirect_stdout(printed), redirect_stderr(said):
        try:
            tactile(list(words))
        except SystemExit as end:
            code = end.code
    if code:
        sys.exit(f"tactile {' '.join(words)}: {said.getvalue()}")
    return printed.getvalue()


def simulated(profile: str, trials: list[Trial], out: Path, seed: int) -> None:
    """Play trials one after another, the object taken away between them."""
    steps = [step for trial in trials for step in (*trial.steps, {"release": {}})]
    script = out.with_suffix(".yaml")
    script.write_text(json.dumps({"steps": steps}))
    command("simulate", profile, "--script", str(script), "--out", str(out), "--seed", str(seed))


def compared(name: str, result: Path, truth: Path) -> Score:
    """Score one frame's results."""
    from scipy.ndimage import distance_transform_edt

    found, true = read_npz(result), read_npz(truth)
    contact = true["contact"]
    depth = distance_transform_edt(contact)
    inner = depth > (1 - PRESS.scored_contact_share) * depth.max()
    error_um = 1e3 * (found["height_mm"] - true["height_mm"])

    def normals(mask: NDArray[np.bool_]) -> float:
        return float(angles_deg(found["gradients"][mask], true["gradients"][mask]).mean())

    def rms(values: NDArray[Any]) -> float:
        return float(np.sqrt(np.mean(values**2)))

    inside = error_um[contact]
    return Score(
        name, normals(contact), normals(inner), float(inside.std()), rms(inside), rms(error_um)
    )


def measured(asked: Asked, folder: Path, presses: int, repeats: int, seed: int) -> list[Score]:
    """Calibrate one model of one rig and measure everything."""
    draw = Draw(load_profile(asked.profile), seed)
    ball, other = folder / f"{asked.profile}_ball", folder / f"{asked.profile}_other"
    trained, trials = draw.calibrating(presses), list(draw.others(repeats))
    if not ball.exists():
        simulated(asked.profile, trained, ball, seed)
        simulated(asked.profile, trials, other, seed)
    bundle, results = folder / f"{asked.model}_bundle", folder / f"{asked.model}_results"
    reference = ("--reference", str(ball / "reference"))
    said = command(
        *("calibrate", asked.profile, "--presses", str(ball / "frames"), *reference),
        *("--ball-diameter-mm", str(draw.ball_mm), "--model", asked.model),
        *("--out", str(bundle), "--json"),
    )
    told = json.loads(said)
    used = sum(press["used"] for press in told["presses"])
    held_out = told["held_out"]["normal_error_deg"]["mean"]
    print(f"{asked.profile} {asked.model}: {used} presses used of {presses} and the frames between")
    print(f"  held out by 'tactile calibrate': {held_out:.2f}°")
    command(
        *("run", asked.profile, "--input", str(other / "frames"), *reference),
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
    parser.add_argument("--rig", choices=sorted({asked.profile for asked in ASKED}))
    parser.add_argument("--presses", type=int, default=18)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    head = f"  {'':14}{'normals':>9}{'inner':>8}{'depth':>9}{'in contact':>12}{'image':>9}"
    summary = []
    with TemporaryDirectory(prefix="virtual-calibration-") as name:
        for asked in ASKED:
            if options.rig not in (None, asked.profile):
                continue
            count = (options.presses, options.repeats, options.seed)
            scores = list(averaged(measured(asked, Path(name), *count)))
            print(head)
            for s in scores:
                print(
                    f"  {s.name:14}{s.normals_deg:8.2f}°{s.inner_normals_deg:7.2f}°"
                    f"{s.depth_um:6.0f} µm{s.inside_um:9.0f} µm{s.image_um:6.0f} µm",
                    flush=True,
                )
            mean = np.mean([[s.normals_deg, s.inside_um] for s in scores], axis=0)
            summary.append(
                f"{asked.profile:25}{asked.model:36}"
                f"{mean[0]:6.2f}° of {asked.normals_deg:g}°{mean[1]:8.0f} of {asked.depth_um:g} µm"
            )
    print("\n".join(["", "mean over objects, whole contact, found of asked:", *summary]))


if __name__ == "__main__":
    main()
