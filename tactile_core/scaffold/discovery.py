"""From a picture of the untouched sensor to what differs from a known build."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.acquisition.geometry import ImageGeometry, Size
from tactile_core.errors import InputError
from tactile_core.formats.scan import Crop
from tactile_core.interfaces.progress import Progress
from tactile_core.pipeline.playback import images_per_observation, read_frames
from tactile_core.profiles.loader import load_profile, load_source
from tactile_core.profiles.model import Profile
from tactile_core.profiles.names import find_profile, is_path, shipped_profiles
from tactile_core.quantities import Pixels
from tactile_core.recordings.inputs import Inputs
from tactile_core.recordings.recording import open_recording
from tactile_core.scaffold.finding import Finding
from tactile_core.scaffold.known_size import KnownSize
from tactile_core.scaffold.lights import find_lights
from tactile_core.scaffold.markers import FoundMarkers, find_markers, markers_finding
from tactile_core.scaffold.profile import NewProfile, render_profile, unseen_note
from tactile_core.scaffold.scale import Scale, agreed, scale_finding
from tactile_core.scaffold.view import find_view, section_of

Ask = Callable[[str], str]
"""Puts a question to somebody and returns the answer, "" where it is not known."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def check_name(name: str) -> None:
    """Refuse a name that cannot name a profile, a plugin and a file alike.

    Raises
    ------
    InputError
        It has other characters than letters, digits and ``_``, or a shipped profile has it.
    """
    if not _NAME.fullmatch(name) or not name.isascii():
        raise InputError(f"{name!r}: a name has letters, digits and '_', and begins with a letter")
    if name in [entry.name for entry in shipped_profiles()]:
        raise InputError(f"{name!r} is the name of a shipped profile; choose another")


def new_profile(
    name: str,
    parent: str | Path,
    image: Path,
    *,
    out: Path | None = None,
    mm_per_px: float | None = None,
    known: KnownSize | None = None,
    marker_pitch_mm: float | None = None,
    target: Path | None = None,
    presses: Path | None = None,
    ball_diameter_mm: float | None = None,
    ask: Ask | None = None,
    progress: Progress | None = None,
) -> NewProfile:
    """Make a minimal profile of one's own sensor from a picture of it.

    Parameters
    ----------
    name : str
        Letters, digits and ``_``.
    parent : str or Path
        The profile that comes nearest, by name or path.
    image : Path
        A recording of the untouched sensor; its first observation counts.
    out : Path, optional
        Where the file is to lie; the path of a parent is written relative to it.
    mm_per_px : float, optional
        Scale of the resulting image.
    known : KnownSize, optional
        A length on the gel, or a rectangle that also straightens the view.
    marker_pitch_mm : float, optional
        Distance of a printed marker to its nearest neighbour, as a rule.
    target : Path, optional
        A grid of balls with circles drawn in the camera's pixels.
    presses : Path, optional
        A recording of a ball pressed here and there, or of the target: tells where each colour's
        light comes from.
    ball_diameter_mm : float, optional
        Needed with presses, except of a target.
    ask : callable, optional
        Is asked for the scale where nothing tells it.

    Raises
    ------
    InputError, ProfileError, CalibrationError
        Something given is unusable, or two things tell different scales.
    """
    check_name(name)
    if presses is not None and ball_diameter_mm is None and target is None:
        raise InputError(
            "how large is the ball in --presses? give --ball-diameter-mm (or --target)"
        )
    if presses is None and ball_diameter_mm is not None:
        raise InputError("--ball-diameter-mm tells of the ball in --presses; give that too")
    base = load_profile(parent)
    picture = _Picture.first_of(image, base)
    if known is not None:
        known.check_within(picture.size_px)
    found = find_view(picture.pixels, base, picture.name, picture.crop, known)
    section = section_of(base, found)
    geometry = ImageGeometry(section)
    seen = [geometry.apply(exposure) for exposure in picture.exposures]
    markers = find_markers(seen, picture.name, marker_pitch_mm)
    camera = picture.size_px
    told = [] if mm_per_px is None else [Scale.given(mm_per_px)]
    if known is not None:
        told.append(Scale.of_known_size(known, section, camera))
    if target is not None:
        told.append(Scale.of_target(target, section, camera))
    if markers is not None and marker_pitch_mm is not None:
        told.append(Scale.of_markers(markers, marker_pitch_mm))
    if picture.mm_per_px is not None:
        told.append(Scale.of_scan(picture.mm_per_px, picture.name, section, camera))
    scale = agreed(told) or (_asked(ask, markers) if ask is not None else None)
    found.append(scale_finding(scale, base, section.width_px))
    printed = markers_finding(markers, base, float(found[-1].values["mm_per_px"]), picture.name)
    if printed is not None:
        found.append(printed)
    tried = _overlaid(parent, found)
    if presses is not None:
        found += find_lights(
            tried,
            base.name,
            presses,
            average(list(read_frames(tried, image))),
            ball_diameter_mm=ball_diameter_mm,
            target=target,
            progress=progress,
        )
    extends = _extends(parent, out)
    text = render_profile(name, extends, base, picture.name, found)
    notes = tuple(finding.comment for finding in found if finding.noted)
    inputs = _inputs(parent, {"--image": image, "--target": target, "--presses": presses})
    return NewProfile(name, text, (*notes, unseen_note(base)), extends != parent, inputs)


def _inputs(parent: str | Path, given: Mapping[str, Path | None]) -> Inputs:
    *older, file = load_source(parent).lineage
    older_ones = {f"{path.name}, which --from extends": path for path in older}
    return Inputs.of({"--from": file, **older_ones, **given})


@dataclass(frozen=True, eq=False)
class _Picture:
    """The untouched sensor as the camera sends it, and what its recording says of it."""

    name: str
    exposures: tuple[Pixels, ...]
    mm_per_px: float | None
    crop: Crop | None

    @classmethod
    def first_of(cls, path: Path, profile: Profile) -> _Picture:
        """Read the first observation."""
        count = images_per_observation(profile)
        recording = open_recording(path, images_per_observation=count)
        first = next(iter(recording), None)
        if first is None:
            raise InputError(f"{path} holds no picture; give one of the untouched sensor")
        exposures = tuple(image.pixels for image in first.images)
        return cls(Path(path).name, exposures, recording.mm_per_px, recording.crop)

    @property
    def pixels(self) -> Pixels:
        """The mean of all lights."""
        if len(self.exposures) == 1:
            return self.exposures[0]
        return np.asarray(np.mean(self.exposures, axis=0)).astype(self.exposures[0].dtype)

    @property
    def size_px(self) -> Size:
        """Width and height."""
        return self.exposures[0].shape[1], self.exposures[0].shape[0]


def _asked(ask: Ask, markers: FoundMarkers | None) -> Scale | None:
    """Ask for what is easiest to know."""
    question = "How many mm on the gel is one pixel wide"
    if markers is not None:
        question = f"Markers are {markers.pitch_px:.1f} px apart: how many mm is that"
    answer = ask(f"{question} (nothing if unknown)?").strip()
    if not answer:
        return None
    try:
        value = float(answer.replace(",", "."))
    except ValueError:
        raise InputError(f"{answer!r} is no number of mm") from None
    if not 0 < value < np.inf:
        raise InputError(f"{answer!r}: a length must be larger than nothing")
    return Scale.given(value) if markers is None else Scale.of_markers(markers, value)


def _overlaid(parent: str | Path, findings: list[Finding]) -> Profile:
    """The parent with what was found."""
    overlay: dict[str, dict[str, Any]] = {}
    for finding in findings:
        overlay.setdefault(finding.section, {}).update(finding.values)
    return load_profile(parent, overrides=overlay)


def _extends(parent: str | Path, out: Path | None) -> str:
    """Name of the parent as it is written into a file at ``out``."""
    if not isinstance(parent, Path) and not is_path(parent):
        return parent
    path = find_profile(parent)
    if out is not None and out.exists() and out.samefile(path):
        raise InputError(f"{out} would replace the profile that it extends; give another --out")
    folder = Path.cwd() if out is None else out.absolute().parent
    relative = Path(os.path.relpath(path.absolute(), folder)).as_posix()
    return json.dumps(relative if "/" in relative else f"./{relative}")
