"""The ground truth of a calibration: balls located in frames, or rows of a height map."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.acquisition.devices import images_per_observation
from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.acquisition.median import median_reference
from tactile_core.algorithms.light.photometric import smooth_background
from tactile_core.calibration.crew import ALONE, Crew
from tactile_core.calibration.light_range import dome_radius_px, thickness_of, undeformed_press
from tactile_core.calibration.press_search import (
    TARGET,
    ball_diameters_mm,
    check_ball,
    find_presses,
    size_words,
)
from tactile_core.calibration.pressed_grid import MapBlock, PressedGrid, PressedMap, blocks
from tactile_core.calibration.presses import FoundPress, select_usable
from tactile_core.calibration.result import Fold, SeparatePresses
from tactile_core.calibration.target_surface import HeightTarget, S, is_height_map
from tactile_core.conditioning.conditioning import Conditioning
from tactile_core.conditioning.gel_check import GelCheck
from tactile_core.errors import InputError
from tactile_core.interfaces.calibration import Press, Progress
from tactile_core.pipeline.initial_reference import MEDIAN, is_word
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Reference
from tactile_core.recordings.recording import open_recording

_STAND_IN = (
    "no image of the undeformed sensor is given, so the large-scale light of the press itself "
    "stands in for it; shapes as large as the image cannot be separated from that light"
)


@dataclass(frozen=True, eq=False)
class CalibrationTarget(Generic[S]):
    """Surfaces with ground truth that a calibration is fitted and scored on.

    Attributes
    ----------
    surfaces : sequence of TargetSurface
        All that were found, unusable ones included.
    basis : str
        A short description, for the report.
    without : callable
        As in :class:`~tactile_core.calibration.scoring.Trials`.
    ball_diameters_mm : tuple of float
        Every size of ball, in order; empty for other targets.
    undeformed : tuple of Press
        Additional training samples of the undeformed gel surface.
    """

    surfaces: Sequence[S]
    basis: str
    without: Callable[[Collection[int]], Fold[S] | None]
    ball_diameters_mm: tuple[float, ...] = ()
    undeformed: tuple[Press, ...] = ()


def undeformed_sensor(
    profile: Profile,
    frames: Sequence[Frame],
    reference: Path | str | None,
    target: Path | None,
    own: Reference | None = None,
) -> tuple[Reference, tuple[str, ...]]:
    """Return the reference of the undeformed sensor, and a note if it is derived from presses.

    Raises
    ------
    InputError
        No reference is given, and the target is no height map.
    """
    if is_word(reference, MEDIAN):
        median, note = median_reference(frames)
        return median, (note,)
    given = own if reference is None else average(list(read_frames(profile, Path(reference))))
    if not is_height_map(target):
        if given is None:
            raise InputError(
                "a calibration needs a reference; give --reference, a recording of the undeformed "
                "sensor or 'median', the median of the presses"
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
    reference_from_press: bool,
) -> CalibrationTarget[MapBlock]:
    """Return bands of rows of a height map; :meth:`HeightTarget.read` lists the errors."""
    read = HeightTarget.read(target, condition(frame), rows=rows, blur_px=blur_px)
    part = target.name
    if rows is not None:
        part = f"rows {rows.start or 0}:{'' if rows.stop is None else rows.stop} of {part}"
    pressed = PressedMap(blocks(read), frame, condition, reference_from_press)
    undeformed = (pressed.sample_undeformed(condition),)
    return CalibrationTarget(pressed.bands, part, pressed.make_fold, undeformed=undeformed)


def balls(
    profile: Profile,
    presses: Path,
    frames: Sequence[Frame],
    condition: Conditioning,
    *,
    ball_diameter_mm: float | None = None,
    labels: Path | None = None,
    target: Path | None = None,
    for_heights: bool = False,
    progress: Progress,
    crew: Crew = ALONE,
) -> CalibrationTarget[FoundPress]:
    """Return presses of a ball, found in each frame or located by a target file.

    ``for_heights`` chooses their training pixels for a calibration that is fitted to heights.

    Raises
    ------
    InputError
        The ball's diameter is missing, implausible, or contradicts the target's.
    CalibrationError
        None of the presses can be used.
    """
    if ball_diameter_mm is not None:
        check_ball(ball_diameter_mm, profile)
    files = _file_names(profile, presses, frames)
    if target is None:
        sizes_mm = ball_diameters_mm(profile, presses, len(frames), ball_diameter_mm)
        for diameter_mm in sorted(set(sizes_mm)):
            check_ball(diameter_mm, profile)
        return separate_balls(
            profile,
            files,
            frames,
            condition,
            sizes_mm,
            labels=labels,
            for_heights=for_heights,
            progress=progress,
            crew=crew,
        )
    progress.stage("finding the circles", 0.25)
    grid, diameter_mm = _on_target(
        profile, presses, files, frames, condition, ball_diameter_mm, target
    )
    grid = replace(grid, for_heights=for_heights)
    found = grid.refine_presses()
    good = select_usable(found)
    return CalibrationTarget(
        found,
        f"{len(good)} presses of {size_words((diameter_mm,))}",
        grid.make_fold,
        ball_diameters_mm=(diameter_mm,),
        undeformed=(undeformed_press(good, condition.undeformed),) if good[0].in_grid else (),
    )


def separate_balls(
    profile: Profile,
    files: Sequence[str],
    frames: Sequence[Frame],
    condition: Conditioning,
    sizes_mm: Sequence[float],
    *,
    labels: Path | None = None,
    for_heights: bool = False,
    progress: Progress,
    crew: Crew = ALONE,
) -> CalibrationTarget[FoundPress]:
    """Return presses of a ball that are found in a frame each.

    Parameters
    ----------
    profile : Profile
    files : sequence of str
        Name of each press, for reports.
    frames : sequence of Frame
        As acquired, not conditioned.
    condition : Conditioning
    sizes_mm : sequence of float
        Diameter of the ball in each frame.
    labels : Path, optional
        Circles that replace the automatic ones: a CSV, or a folder; see
        :func:`~tactile_core.formats.labels.read_labels`.
    for_heights : bool
        The training pixels are for a calibration that is fitted to heights.
    progress : Progress
    crew : Crew
        Processes that share the work.

    Raises
    ------
    CalibrationError
        None of the presses can be used.
    """
    progress.stage("finding the circles", 0.25)
    ready = [condition(frame) for frame in frames]
    circled = _find_presses(
        profile, files, ready, condition.undeformed, sizes_mm, labels, progress, crew
    )
    found = [replace(press, for_heights=for_heights) for press in circled]
    good = select_usable(found)
    diameters_mm = tuple(sorted(set(sizes_mm)))
    return CalibrationTarget(
        found,
        f"{len(good)} presses of {size_words(diameters_mm)}",
        SeparatePresses(found, condition.undeformed, labelled=labels is not None).make_fold,
        ball_diameters_mm=diameters_mm,
    )


def _check_single(frames: Sequence[Frame]) -> None:
    if len(frames) != 1:
        raise InputError(
            f"a target describes one observation, but --presses holds {len(frames)}; give the one "
            f"image or scan that shows the target"
        )


def _file_names(profile: Profile, path: Path, frames: Sequence[Frame]) -> list[str]:
    """Return the name of each frame's image file; of its observation if it has several files."""
    count = images_per_observation(profile)
    recording = open_recording(path, images_per_observation=count)
    single = {
        files.name: files.paths[0].relative_to(path).as_posix() if path.is_dir() else path.name
        for files in recording.files
        if count == 1
    }
    return [single.get(frame.source, frame.source) for frame in frames]


def _find_presses(
    profile: Profile,
    files: Sequence[str],
    frames: Sequence[Frame],
    reference: Reference,
    sizes_mm: Sequence[float],
    labels: Path | None,
    progress: Progress,
    crew: Crew,
) -> list[FoundPress]:
    scale = profile.image.mm_per_px
    radii_px = [diameter_mm / 2 / scale for diameter_mm in sizes_mm]
    given: Mapping[str, Any] | None = None
    if labels is not None:
        from tactile_core.formats.labels import read_labels

        given = read_labels(
            labels,
            size_px=(profile.image.width_px, profile.image.height_px),
            largest_radius_px=TARGET.widest_label * max(radii_px),
        )
    return find_presses(
        files,
        frames,
        reference,
        radii_px,
        dome_radius_px=dome_radius_px(profile),
        thickness_mm=thickness_of(profile),
        labels=given,
        check=GelCheck(reference, view=ImageGeometry(profile.image).view()),
        progress=progress,
        crew=crew,
    )


def _on_target(
    profile: Profile,
    presses: Path,
    files: Sequence[str],
    frames: Sequence[Frame],
    condition: Conditioning,
    ball_diameter_mm: float | None,
    target: Path,
) -> tuple[PressedGrid, float]:
    from tactile_core.formats.target import read_target

    grid = read_target(target)
    check_ball(2 * grid.radius_mm, profile)
    if ball_diameter_mm is not None:
        off = abs(ball_diameter_mm / (2 * grid.radius_mm) - 1)
        if off > 0.01:  # [ratio] the tolerance of all scales
            raise InputError(
                f"{target} describes a ball of {2 * grid.radius_mm:g} mm, but --ball-diameter-mm "
                f"is {ball_diameter_mm:g}; leave the option out or correct it"
            )
    _check_single(frames)
    camera_size_px = open_recording(
        presses, images_per_observation=images_per_observation(profile)
    ).size_px
    geometry = ImageGeometry(profile.image)
    grid = grid.at_scale(geometry.camera_mm_per_px(camera_size_px))
    centres = geometry.map_points(grid.centres_px, camera_size_px)
    radius_px = grid.radius_mm / profile.image.mm_per_px
    dome_px = dome_radius_px(profile)
    thickness_mm = thickness_of(profile)
    pressed = PressedGrid(files[0], frames[0], condition, centres, radius_px, dome_px, thickness_mm)
    return pressed, 2 * grid.radius_mm
