"""Determine how a sensor differs from an existing profile, from an image of the undeformed gel."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.acquisition.devices import images_per_observation
from tactile_core.acquisition.geometry import ImageGeometry, Size
from tactile_core.errors import InputError
from tactile_core.formats.scan import Crop
from tactile_core.formats.text import shorten_repr
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import (
    find_profile,
    is_path,
    list_profiles,
    load_profile,
    load_source,
    shipped_profiles,
)
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Pixels
from tactile_core.recordings.inputs import Inputs
from tactile_core.recordings.recording import open_recording
from tactile_core.scaffold.markers import (
    FoundMarkers,
    PictureFinding,
    find_markers,
    markers_finding,
)
from tactile_core.scaffold.profile import NewProfile, render_profile, unseen_note
from tactile_core.scaffold.scale import (
    Scale,
    ScaleMethod,
    agree_on_scale,
    measure_scale,
    scale_finding,
)
from tactile_core.scaffold.view import find_view, section_of

Ask = Callable[[str], str]  # Asks the user a question and returns the answer; empty if unknown

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def check_name(name: str) -> None:
    """Check that a name is valid for a profile, a plugin and a file.

    Raises
    ------
    InputError
        It has characters other than letters, digits and ``_``, or is that of a shipped profile.
    """
    if not _NAME.fullmatch(name) or not name.isascii() or len(name) > 100:
        raise InputError(
            f"{shorten_repr(name)}: a name has up to 100 letters, digits and '_', and begins "
            f"with a letter"
        )
    if name in [entry.name for entry in shipped_profiles()]:
        raise InputError(f"{name!r} is the name of a shipped profile; choose another")


def new_profile(
    name: str,
    parent: str | Path,
    image: Path,
    *,
    out: Path | None = None,
    scale: str | None = None,
    scale_image: Path | None = None,
    ask: Ask | None = None,
) -> NewProfile:
    """Make a minimal profile of a sensor from an image of it.

    Parameters
    ----------
    name : str
        Letters, digits and ``_``.
    parent : str or Path
        The most similar profile, by name or path.
    image : Path
        A recording of the undeformed sensor; the first observation is used.
    out : Path, optional
        Destination of the profile; the path of a parent is written relative to it.
    scale : str, optional
        How the scale of the resulting image is measured, as ``--scale`` takes it:
        mm per pixel; ``grid:2``, ``calliper:10`` or ``balls:6`` in ``scale_image``; ``markers:1.5``
        in ``image``; ``calliper:10@x,y,x,y`` or ``rectangle:24x32@…`` with positions in the
        camera's image; or the YAML of a ball grid. A rectangle also rectifies the perspective.
    scale_image : Path, optional
        A recording of the same camera that shows the grid, or both imprints.
    ask : callable, optional
        Called for the scale if no input determines it.

    Returns
    -------
    NewProfile

    Raises
    ------
    InputError, ProfileError
        An input cannot be used, or two inputs give different scales.
    """
    check_name(name)
    method = None if scale is None else ScaleMethod.parse(scale)
    if scale_image is None and method is not None and method.needs_image:
        raise InputError(f"--scale {scale} needs --scale-image, a picture that shows it")
    if scale_image is not None and (method is None or not method.needs_image):
        raise InputError("--scale-image is for --scale grid:2, calliper:10 or balls:6 alone")
    base = load_profile(parent)
    picture = _Picture.first_of(image, base)
    camera = picture.size_px
    if method is not None and method.points_px:
        method.check_within(camera)
    shows = picture if scale_image is None else _Picture.first_of(scale_image, base)
    if shows.size_px != camera:
        raise InputError(
            f"--scale-image has {shows.size_px[0]} × {shows.size_px[1]} px and --image "
            f"{camera[0]} × {camera[1]}; record both alike"
        )
    found = find_view(picture.pixels, base, picture.name, picture.crop, method)
    section = section_of(base, found)
    geometry = ImageGeometry(section)
    rest = [geometry.apply(exposure) for exposure in picture.exposures]
    seen = [geometry.apply(exposure) for exposure in shows.exposures]
    markers = find_markers(rest)
    if method is None and picture.mm_per_px is None and ask is not None:
        method = _ask_scale(ask, markers)
    scales = []
    if method is not None:
        scales.append(
            measure_scale(method, section, camera, _together(seen), _together(rest), markers)
        )
        if method.kind == "markers" and markers is not None:
            markers = replace(markers, pitch_px=method.size_mm[0] / scales[0].mm_per_px)
    if picture.mm_per_px is not None:
        scales.append(Scale.of_scan(picture.mm_per_px, picture.name, section, camera))
    found.append(scale_finding(agree_on_scale(scales), base, section.width_px))
    printed = markers_finding(markers, base, float(found[-1].values["mm_per_px"]), picture.name)
    if printed is not None:
        found.append(printed)
    found += _any_camera(base)
    _refuse_impossible(parent, found)
    extends = _extends(parent, out)
    text = render_profile(name, extends, base, picture.name, found)
    notes = tuple(finding.comment for finding in found if finding.noted)
    target = None if method is None else method.target
    inputs = _inputs(parent, {"--image": image, "--scale": target, "--scale-image": scale_image})
    return NewProfile(
        name, text, (*notes, unseen_note(base)), extends, _own_files(parent, extends), inputs
    )


def _any_camera(parent: Profile) -> list[PictureFinding]:
    """Return the finding that the parent's camera is not this one; none if it names no device."""
    if parent.camera is None:
        return []
    chosen = resolve("camera", parent.camera.use).selectors
    named = [key for key in chosen if parent.camera.options.get(key) is not None]
    comment = (
        f"Not {parent.name}'s camera, but the one that is connected. With several, choose yours by "
        f"{', '.join(chosen)}: 'tactile devices' lists them."
    )
    return [PictureFinding("camera", comment, dict.fromkeys(named))] if named else []


def _own_files(parent: str | Path, extends: str) -> tuple[Path, ...]:
    """Return the parent's file and those that it extends by path; none for a parent by name."""
    if extends == parent:
        return ()
    named = {entry.path.resolve() for entry in list_profiles()}
    own = [path for path in load_source(parent).lineage if path.resolve() not in named]
    return tuple(reversed(own))


def _inputs(parent: str | Path, given: Mapping[str, Path | None]) -> Inputs:
    *ancestors, file = load_source(parent).lineage
    extended = {f"{path.name}, which --from extends": path for path in ancestors}
    return Inputs.from_paths({"--from": file, **extended, **given})


@dataclass(frozen=True, eq=False)
class _Picture:
    """The undeformed sensor as the camera sends it, with scale and crop from its recording."""

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
            raise InputError(f"{path} holds no image; give one of the undeformed sensor")
        exposures = tuple(image.pixels for image in first.images)
        return cls(Path(path).name, exposures, recording.mm_per_px, recording.crop)

    @property
    def pixels(self) -> Pixels:
        """The mean over all lights."""
        if len(self.exposures) == 1:
            return self.exposures[0]
        return np.asarray(np.mean(self.exposures, axis=0)).astype(self.exposures[0].dtype)

    @property
    def size_px(self) -> Size:
        """Width and height in px."""
        return self.exposures[0].shape[1], self.exposures[0].shape[0]


def _together(exposures: list[Pixels]) -> Pixels:
    return np.concatenate([np.atleast_3d(exposure) for exposure in exposures], axis=2)


def _ask_scale(ask: Ask, markers: FoundMarkers | None) -> ScaleMethod | None:
    """Ask for the marker pitch if there are markers, else for the scale."""
    question = "How many mm on the gel is one pixel wide"
    if markers is not None:
        question = f"Markers are {markers.pitch_px:.1f} px apart: how many mm is that"
    answer = ask(f"{question} (nothing if unknown)?").strip().replace(",", ".")
    if not answer:
        return None
    return ScaleMethod.parse(answer if markers is None else f"markers:{answer}")


def _refuse_impossible(parent: str | Path, findings: list[PictureFinding]) -> None:
    """Raise a ProfileError if the parent does not load with these findings."""
    overlay: dict[str, dict[str, Any]] = {}
    for finding in findings:
        overlay.setdefault(finding.section, {}).update(finding.values)
    load_profile(parent, overrides=overlay)


def _extends(parent: str | Path, out: Path | None) -> str:
    """Return the value of ``extends`` in a file at ``out``."""
    if not isinstance(parent, Path) and not is_path(parent):
        return parent
    path = find_profile(parent)
    if out is not None and out.exists() and out.samefile(path):
        raise InputError(f"{out} would replace the profile that it extends; give another --out")
    folder = Path.cwd() if out is None else out.absolute().parent
    relative = Path(os.path.relpath(path.absolute(), folder)).as_posix()
    return json.dumps(relative if "/" in relative else f"./{relative}")
