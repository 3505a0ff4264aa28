"""What a calibration is fitted and scored on: balls that were found, or rows of a height map."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.background import smooth_background
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.calibration.height_target import HeightTarget, is_height_map
from tactile_core.calibration.held_out import Fold, SeparatePresses
from tactile_core.calibration.known_surface import S
from tactile_core.calibration.map_rows import MapBlock, blocks
from tactile_core.calibration.pressed_grid import PressedGrid
from tactile_core.calibration.pressed_map import PressedMap
from tactile_core.calibration.presses import FoundPress, find_presses, undeformed_press, used
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.errors import InputError
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.progress import Progress
from tactile_core.pipeline.playback import images_per_observation, read_frames
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.recording import open_recording

BALL_TOLERANCE = 0.01
LARGEST_BALL_MM = 1000.0
WIDEST_LABEL = 1.25
"""Radius of a circle drawn by hand, over the ball's: published ones have up to 1.18, for they
include the dark rim around the ball. What is trusted of a press is limited by the ball itself."""

_STAND_IN = (
    "no picture of the untouched sensor is given, so the press's own large-scale light stands in "
    "for it; shapes as large as the image cannot be told from it"
)


@dataclass(frozen=True, eq=False)
class Known(Generic[S]):
    """What a calibration is fitted and scored on.

    Attributes
    ----------
    surfaces : sequence of KnownSurface
        All that were found, those of no use too.
    basis : str
        What they are, for people.
    ball_diameter_mm : float or None
    at_rest : tuple of Press
        Samples of skin at rest, to fit on beside them.
    without : callable
        As in :func:`~tactile_core.calibration.scoring.cross_validate`.
    """

    surfaces: Sequence[S]
    basis: str
    without: Callable[[Collection[int]], Fold[S] | None]
    ball_diameter_mm: float | None = None
    at_rest: tuple[Press, ...] = ()


def undeformed_sensor(
    profile: Profile, frames: Sequence[Frame], reference: Path | None, target: Path | None
) -> tuple[Reference, tuple[str, ...]]:
    """Return the untouched sensor, and a note where it is only a stand-in made from the press.

    Raises
    ------
    InputError
        No reference is given, and the target is no height map.
    """
    given = None if reference is None else average(list(read_frames(profile, reference)))
    if not is_height_map(target):
        if given is None:
            raise InputError(
                "what does the untouched sensor look like? give --reference, a recording of it"
            )
        return given, ()
    _check_single(frames)
    press = frames[0]
    if given is not None and not np.array_equal(given.pixels, press.pixels):
        return given, ()
    light = smooth_background(press.pixels, press.marker_mask)
    return replace(average([press]), pixels=light), (_STAND_IN,)


def rows_of_map(
    target: Path,
    frame: Frame,
    condition: Conditioning,
    rows: slice | None,
    blur_px: float,
    *,
    stands_in: bool,
) -> Known[MapBlock]:
    """Bands of a height map's rows; see :class:`HeightTarget` for what is refused."""
    read = HeightTarget.read(target, condition(frame), rows=rows, blur_px=blur_px)
    part = target.name
    if rows is not None:
        part = f"rows {rows.start or 0}:{'' if rows.stop is None else rows.stop} of {part}"
    pressed = PressedMap(blocks(read), frame, condition, stands_in)
    return Known(pressed.bands, part, pressed.without, at_rest=(pressed.at_rest(condition),))


def balls(
    profile: Profile,
    presses: Path,
    frames: Sequence[Frame],
    condition: Conditioning,
    *,
    ball_diameter_mm: float | None = None,
    labels: Path | None = None,
    target: Path | None = None,
    progress: Progress,
) -> Known[FoundPress]:
    """Presses of a ball, found in each frame, or on a target that tells where they are.

    Raises
    ------
    InputError
        The ball's diameter is not given, or contradicts the target's.
    CalibrationError
        None of the presses can be used.
    """
    if ball_diameter_mm is not None:
        _check_ball(ball_diameter_mm, profile)
    files = _file_names(profile, presses, frames)
    progress.stage("finding the circles", 0.25)
    if target is None:
        ready = [condition(frame) for frame in frames]
        found, radius_mm = _found(
            profile, files, ready, condition.undeformed, ball_diameter_mm, labels, progress
        )
        without = SeparatePresses(found, condition.undeformed, given=labels is not None).without
    else:
        grid, radius_mm = _on_target(
            profile, presses, files, frames, condition, ball_diameter_mm, target
        )
        found, without = grid.found(), grid.without
    good = used(found)
    return Known(
        found,
        f"{len(good)} presses of a ball of {2 * radius_mm:g} mm",
        without,
        ball_diameter_mm=2 * radius_mm,
        at_rest=(undeformed_press(good, condition.undeformed),) if good[0].in_grid else (),
    )


def _check_ball(diameter_mm: float, profile: Profile) -> None:
    if not 0 < diameter_mm <= LARGEST_BALL_MM:
        raise InputError(
            f"a ball of {diameter_mm:g} mm? --ball-diameter-mm must be positive and at most "
            f"{LARGEST_BALL_MM:g}"
        )
    if diameter_mm / 2 < profile.image.mm_per_px:
        raise InputError(
            f"a ball of {diameter_mm:g} mm is smaller than two pixels of "
            f"{profile.image.mm_per_px:g} mm; correct its diameter or 'image.mm_per_px'"
        )


def _check_single(frames: Sequence[Frame]) -> None:
    if len(frames) != 1:
        raise InputError(
            f"a target describes one observation and {len(frames)} were given; give --presses the "
            f"one image or scan that shows it"
        )


def _file_names(profile: Profile, path: Path, frames: Sequence[Frame]) -> list[str]:
    """Name of each frame's image file; of its observation where that is no single file."""
    count = images_per_observation(profile)
    recording = open_recording(path, images_per_observation=count)
    single = {files.name: files.paths[0].name for files in recording.files if count == 1}
    return [single.get(frame.source, frame.source) for frame in frames]


def _found(
    profile: Profile,
    files: Sequence[str],
    frames: Sequence[Frame],
    reference: Reference,
    ball_diameter_mm: float | None,
    labels: Path | None,
    progress: Progress,
) -> tuple[list[FoundPress], float]:
    scale = profile.image.mm_per_px
    if ball_diameter_mm is None:
        raise InputError("how large is the ball? give --ball-diameter-mm (or --target)")
    radius_mm = ball_diameter_mm / 2
    given: Mapping[str, Any] | None = None
    if labels is not None:
        from tactile_core.formats.labels import read_labels

        given = read_labels(
            labels,
            size_px=(profile.image.width_px, profile.image.height_px),
            largest_radius_px=WIDEST_LABEL * radius_mm / scale,
        )
    found = find_presses(
        files,
        frames,
        reference,
        radius_mm / scale,
        dome_radius_px=_dome_radius_px(profile),
        thickness_mm=_thickness_mm(profile),
        labels=given,
        progress=progress,
    )
    return found, radius_mm


def _on_target(
    profile: Profile,
    presses: Path,
    files: Sequence[str],
    frames: Sequence[Frame],
    condition: Conditioning,
    ball_diameter_mm: float | None,
    target: Path,
) -> tuple[PressedGrid, float]:
    from tactile_core.acquisition.geometry import ImageGeometry
    from tactile_core.formats.target import read_target

    grid = read_target(target)
    _check_ball(2 * grid.radius_mm, profile)
    if ball_diameter_mm is not None:
        off = abs(ball_diameter_mm / (2 * grid.radius_mm) - 1)
        if off > BALL_TOLERANCE:
            raise InputError(
                f"{target} says a ball of {2 * grid.radius_mm:g} mm and --ball-diameter-mm "
                f"{ball_diameter_mm:g}; leave the option out or correct it"
            )
    _check_single(frames)
    camera_size_px = open_recording(
        presses, images_per_observation=images_per_observation(profile)
    ).size_px
    geometry = ImageGeometry(profile.image)
    grid = grid.at_scale(geometry.camera_mm_per_px(camera_size_px))
    centres = geometry.map_points(grid.centres_px, camera_size_px)
    radius_px = grid.radius_mm / profile.image.mm_per_px
    dome_px = _dome_radius_px(profile)
    thickness_mm = _thickness_mm(profile)
    pressed = PressedGrid(files[0], frames[0], condition, centres, radius_px, dome_px, thickness_mm)
    return pressed, grid.radius_mm


def _thickness_mm(profile: Profile) -> float:
    return THICKNESS_MM if profile.gel.thickness_mm is None else profile.gel.thickness_mm


def _dome_radius_px(profile: Profile) -> float | None:
    radius_mm = profile.gel.radius_mm
    return None if radius_mm is None else radius_mm / profile.image.mm_per_px
