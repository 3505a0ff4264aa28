"""The diameters of the balls that are pressed, and what of them is plausible."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.catalog import CATALOG_FILE, find_catalog
from tactile_core.pipeline.playback import images_per_observation
from tactile_core.profiles.model import Profile
from tactile_core.recordings.recording import open_recording


class TARGET:
    """Plausibility limits of balls and labels. Nothing sets them from outside: they catch typos."""

    # [ratio] ``--ball-diameter-mm`` and the target's radius may differ by this share. Source: the
    # tolerance of all scales, as for bundles (``bundles/bundle.py``).
    ball_tolerance = 0.01
    # [mm] Larger diameters are refused. Source: by hand, far beyond any tactile sensor.
    largest_ball_mm = 1000.0
    # [ball radii] Largest radius of a labelled circle. Circles drawn by hand include the dark rim
    # around the ball; the ball's own radius limits the training pixels. Source: published labels
    # have up to 1.18 (``tests/formats/test_labels.py``), plus a margin.
    widest_label = 1.25


_A_CATALOG = f"a {CATALOG_FILE} in the folder of presses"


def ball_diameters_mm(
    profile: Profile, presses: Path, count: int, others_mm: float | None
) -> tuple[float, ...]:
    """Return the diameter of the ball in each observation of a recording.

    Parameters
    ----------
    profile : Profile
    presses : Path
        Its ``catalog.csv`` rules where it lists an observation.
    count : int
        Number of observations.
    others_mm : float, optional
        Diameter in observations that no catalogue lists.

    Raises
    ------
    InputError
        The diameter of an observation is missing.
    """
    catalog = find_catalog(presses) if presses.is_dir() else None
    if catalog is None:
        if others_mm is None:
            other = presses / CATALOG_FILE
            raise InputError(
                f"the ball's diameter is missing; give --ball-diameter-mm (or --target, or "
                f"{f'the columns file,diameter_mm in {other}' if other.is_file() else _A_CATALOG})"
            )
        return (others_mm,) * count
    catalog.check_listed()
    files = open_recording(presses, images_per_observation=images_per_observation(profile)).files
    listed = [catalog.diameter_mm(file.paths[0]) for file in files]
    missing = [file.name for file, size in zip(files, listed, strict=True) if size is None]
    if missing and others_mm is None:
        raise InputError(
            f"{catalog.path} has no diameter of the ball in {missing[0]}; add a line, or give "
            f"--ball-diameter-mm for all that it does not list"
        )
    return tuple(size if size is not None else float(others_mm or 0) for size in listed)


def size_words(diameters_mm: Sequence[float]) -> str:
    """Return ``a ball of 4 mm`` or ``balls of 4 and 6.31 mm``."""
    *rest, last = (f"{diameter:g}" for diameter in diameters_mm)
    return f"balls of {', '.join(rest)} and {last} mm" if rest else f"a ball of {last} mm"


def check_ball(diameter_mm: float, profile: Profile) -> None:
    """Check that a diameter is plausible at the profile's scale.

    Raises
    ------
    InputError
        It is not positive, above a metre, or below two pixels.
    """
    if not 0 < diameter_mm <= TARGET.largest_ball_mm:
        raise InputError(
            f"a ball of {diameter_mm:g} mm? --ball-diameter-mm must be positive and at most "
            f"{TARGET.largest_ball_mm:g}"
        )
    if diameter_mm / 2 < profile.image.mm_per_px:
        raise InputError(
            f"a ball of {diameter_mm:g} mm is smaller than two pixels of "
            f"{profile.image.mm_per_px:g} mm; correct its diameter or 'image.mm_per_px'"
        )
