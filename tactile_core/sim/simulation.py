"""Frames of a virtual rig on disk, with the truth beside each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.folders import fresh_folder, move_in, resolved
from tactile_core.formats.images import write_png
from tactile_core.formats.npz import write_npz
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.quantities import Frame
from tactile_core.sim.script import Script
from tactile_core.sim.stage import VirtualStage
from tactile_core.sim.truth import TrueState

FRAMES, TRUTH, REFERENCE = "frames", "truth", "reference"
_COLOURS = 3


def simulate(
    stage: VirtualStage, script: Script, out: Path, *, progress: Progress | None = None
) -> int:
    """Play a script on a stage and write what the camera sees and what is true, all or nothing.

    ``out/frames`` is a recording, ``out/reference`` one of the untouched sensor, and
    ``out/truth/NAME.npz`` holds the truth of each frame under the names that ``tactile run`` uses,
    with ``stick`` and ``time_s`` beside them.

    Parameters
    ----------
    stage : VirtualStage
        It is reset first.
    script : Script
    out : Path
        A folder that is not there, or empty.
    progress : Progress, optional

    Returns
    -------
    int
        How many frames there are.

    Raises
    ------
    InputError
        A step of the script is impossible, or there is something in the folder.
    OSError
        The disk is full or refuses; nothing is left.
    """
    progress = progress or Silent()
    place = resolved(Path(out))
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise _taken(out)
    progress.stage("simulating", 1.0)
    with fresh_folder(place) as fresh:
        stage.reset()
        (fresh / TRUTH).mkdir()
        write_frame(fresh / REFERENCE, stage.frame(), "undeformed")
        for number, _ in enumerate(script.played(stage)):
            name = f"{number:06d}"
            write_frame(fresh / FRAMES, stage.frame(), name)
            write_npz(fresh / TRUTH / f"{name}.npz", truth_arrays(stage.truth()))
            progress.fraction((number + 1) / script.frames)
        try:
            move_in(fresh, place)
        except FileExistsError:
            raise _taken(out) from None
    return script.frames


def _taken(out: Path) -> InputError:
    return InputError(f"{out} is there already; give another --out, or empty it")


def truth_arrays(truth: TrueState) -> Mapping[str, NDArray[Any]]:
    """Arrays of a truth, under the names that measured ones have."""
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
    }


def write_frame(folder: Path, frame: Frame, name: str) -> None:
    """Write a colour image, or a folder with one grey image per lamp fired in turn."""
    pixels = frame.pixels
    in_turn = len(frame.exposure_times_s) > 1 or pixels.shape[2] not in (1, _COLOURS)
    inside = folder / name if in_turn else folder
    inside.mkdir(parents=True, exist_ok=True)
    if not in_turn:
        write_png(folder / f"{name}.png", pixels[..., 0] if pixels.shape[2] == 1 else pixels)
        return
    for k in range(pixels.shape[2]):
        write_png(inside / f"{k:02d}.png", np.ascontiguousarray(pixels[..., k]))
