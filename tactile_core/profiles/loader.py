"""Loads profiles by name or path."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tactile_core.errors import InputError, Place, Problem, ProfileError
from tactile_core.formats.files import expand_home, is_file
from tactile_core.formats.text import shorten_repr
from tactile_core.formats.yaml_tree import Node, problem_at, read_yaml, refusal
from tactile_core.interfaces.component import VIRTUAL_CAMERA
from tactile_core.profiles.components import check_components
from tactile_core.profiles.model import Profile
from tactile_core.profiles.source import Source, read_source

_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True)
class ProfileEntry:
    """A profile that can be found by name.

    Attributes
    ----------
    name : str
    path : Path
    origin : str
        "shipped", or the plugin that provides it.
    """

    name: str
    path: Path
    origin: str


def list_profiles() -> list[ProfileEntry]:
    """List the shipped profiles, then those of plugins.

    Imports every installed plugin.
    """
    from tactile_core.plugins.registry import profile_directories

    entries = shipped_profiles()
    for plugin, directory in profile_directories().items():
        entries += _in_directory(directory, f"plugin {plugin}")
    return entries


def list_rigs() -> list[ProfileEntry]:
    """List the shipped profiles that do not extend another profile."""
    entries = shipped_profiles()
    return [entry for entry in entries if read_yaml(entry.path)[0].get("extends") is None]


def find_profile(name_or_path: str | Path) -> Path:
    """Return the path of a profile's file.

    Parameters
    ----------
    name_or_path : str or Path
        A path if it is a Path, contains a separator or ends in ``.yaml``; otherwise a name.
        Shipped profiles are found without importing a plugin.

    Raises
    ------
    ProfileError
        No profile or more than one has this name.
    """
    if isinstance(name_or_path, Path) or is_path(name_or_path):
        try:
            return expand_home(name_or_path)
        except InputError as error:
            raise ProfileError(str(error)) from None
    for entry in shipped_profiles():
        if entry.name == name_or_path:
            return entry.path
    entries = list_profiles()
    found = [entry for entry in entries if entry.name == name_or_path]
    if not found:
        raise ProfileError(_unknown(name_or_path, [entry.name for entry in entries]))
    if len(found) > 1:
        origins = " and ".join(entry.origin for entry in found)
        raise ProfileError(
            f"profile {name_or_path!r} is provided by {origins}; give its path instead"
        )
    return found[0].path


def find_extended(name_or_path: str, place: Place) -> Path:
    """Return the file that ``extends`` names; a path is relative to the file with that line.

    Raises
    ------
    ProfileError
        See :func:`find_profile`; the error carries the position.
    """
    try:
        found = find_profile(name_or_path)
        if is_path(name_or_path):
            found = place.file.parent / found
            if not is_file(found):
                raise ProfileError(f"there is no file {found}")
    except ProfileError as error:
        problem = problem_at(place, ("extends",), str(error))
        raise ProfileError(str(problem), [problem]) from None
    return found


def is_path(text: str) -> bool:
    """Whether the text is a path: it contains a separator or ends in ``.yaml``."""
    return "/" in text or os.sep in text or text.endswith(_SUFFIXES)


def _unknown(name: str, known: Sequence[str]) -> str:
    file = next((name + suffix for suffix in _SUFFIXES if is_file(Path(name + suffix))), None)
    close = get_close_matches(name, known, 1)
    if file is not None:
        hint = f"for the file here write {file!r}; "
    else:
        hint = f"did you mean {close[0]!r}? Otherwise " if close else ""
    return (
        f"there is no profile {shorten_repr(name)}; {hint}there are {', '.join(known)}, and a file "
        f"is named by its path (ending in .yaml)"
    )


def shipped_profiles() -> list[ProfileEntry]:
    """List the profiles of the core, without importing a plugin."""
    import sensor_profiles

    return _in_directory(sensor_profiles.DIRECTORY, "shipped")


def _in_directory(directory: Path, origin: str) -> list[ProfileEntry]:
    return [ProfileEntry(path.stem, path, origin) for path in sorted(directory.glob("*.yaml"))]


# Position reported for overrides; their paths are relative to the working directory.
_OVERRIDES = Place(Path("overrides"))

_SIM = Place(Path("virtual sensor"))  # position of what the overlay below sets

# Overlay of every virtual sensor: its camera delivers the rectified image directly, and its light
# is not that of the real ones.
_VIRTUAL: Mapping[str, Any] = {
    "camera": {"use": VIRTUAL_CAMERA},
    "starting_bundle": None,
    "image": {"crop": None, "lens": None, "warp": None, "flip": "none", "rotate_deg": 0},
}


def load_profile(
    name_or_path: str | Path,
    *,
    sim: bool = False,
    overrides: Mapping[str, Any] | None = None,
    components: bool = True,
    replayed: bool = False,
) -> Profile:
    """Load and validate a profile and the components that it names.

    Parameters
    ----------
    name_or_path : str or Path
        Name of a shipped profile or of a plugin's profile, or the path of a YAML file.
    sim : bool
        Load the virtual sensor: a virtual camera, then the profile's ``sim`` overlay.
    overrides : mapping, optional
        Merged last, by the rules of ``extends``: ``{"gel": {"friction": 0.3}}``.
    components : bool
        If False, no plugin is imported: the components' options are not checked and their
        relative paths are not resolved.
    replayed : bool
        A recording is measured: the camera is not opened, so its plugin may be absent.

    Raises
    ------
    ProfileError
        The profile is invalid; the error lists every mistake with file, line, column and key.
    """
    source = load_source(name_or_path, sim=sim, overrides=overrides)
    problems = [*source.problems, *validate_structure(source)]
    settings = source.settings.plain()
    if components:
        checked = check_components(source)
        problems += [p for p in checked.problems if not (replayed and p.key == "camera.use")]
        settings = checked.settings
    if problems:
        raise refusal(problems)
    return Profile.model_validate(settings)


def load_source(
    name_or_path: str | Path, *, sim: bool = False, overrides: Mapping[str, Any] | None = None
) -> Source:
    """Read a profile and everything that it extends, without validation.

    Raises
    ------
    ProfileError
        There is no such profile, or its file cannot be parsed.
    """
    source = read_source(find_profile(name_or_path), find_extended)
    overlay = source.tree.get("sim")
    if sim:
        source = source.merge_overlay(Node.from_plain(_VIRTUAL, _SIM))
        if overlay is not None and overlay.is_mapping:
            source = source.merge_overlay(overlay)
    if overrides:
        source = source.merge_overlay(Node.from_plain(overrides, _OVERRIDES))
    return source


def validate_structure(source: Source) -> list[Problem]:
    """Return a profile's mistakes outside its components, without importing a plugin.

    The ``sim`` overlay is validated by merging it into the profile.
    """
    problems = _mistakes(source)
    overlay = source.tree.get("sim")
    if overlay is not None and overlay.is_mapping:
        reported = {(p.file, p.line, p.column) for p in problems}
        problems += [
            Problem(p.file, p.line, p.column, f"sim.{p.key}", p.message)
            for p in _mistakes(source.merge_overlay(overlay))
            if (p.file, p.line, p.column) not in reported
        ]
    return problems


def profile_hash(profile: Profile) -> str:
    """Return a fingerprint of everything in the profile that a calibration depends on.

    The first 16 hex digits of the SHA-256 of the image section with its defaults, the illumination
    without its driver, and the gel's coating, markers and dome, as JSON with sorted keys. 19 and
    19.0 count as the same number. The scale is excluded: a recording may have its own, and a
    bundle compares it separately.
    """
    gel = profile.gel.model_dump(mode="json", include={"coating", "markers"})
    if profile.gel.radius_mm is not None:
        gel["radius_mm"] = profile.gel.radius_mm
    matters = {
        "image": profile.image.model_dump(mode="json", exclude={"mm_per_px"}),
        "illumination": profile.illumination.model_dump(mode="json", exclude={"driver"}),
        "gel": gel,
    }
    text = json.dumps(_canonical(matters), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _mistakes(source: Source) -> list[Problem]:
    tree = source.settings
    try:
        Profile.model_validate(tree.plain())
    except ValidationError as error:
        from tactile_core.profiles.problems import MISSING, problems_of  # for mistakes alone

        problems = problems_of(error, tree, Profile)
        # a key that an unreadable parent may define is not reported as missing
        return [p for p in problems if source.whole or p.message != MISSING]
    return []


def _canonical(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
