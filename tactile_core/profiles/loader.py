"""From a profile's name or path to a validated :class:`Profile`, or every mistake in it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from pydantic import ValidationError

from tactile_core.errors import ProfileError
from tactile_core.profiles.model import Profile
from tactile_core.profiles.parts import part_problems, with_absolute_paths
from tactile_core.profiles.problems import problems_of
from tactile_core.profiles.source import Place, Problem, merge, read_merged, without_nulls


@dataclass(frozen=True)
class ProfileEntry:
    """A profile that can be named.

    Attributes
    ----------
    name : str
    path : Path
    origin : str
        "shipped", or the plugin that brings it.
    """

    name: str
    path: Path
    origin: str


def load_profile(name_or_path: str | Path, *, sim: bool = False) -> Profile:
    """Load a profile and validate it, with the parts that it names.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped or plugin's profile by name, or the path of a YAML file.
    sim : bool
        Lay the profile's ``sim`` overlay over it: the virtual twin.

    Raises
    ------
    ProfileError
        With every mistake at once, each with file, line, column and key.
    """
    tree = read_merged(find_profile(name_or_path), _extended)
    overlay = tree.get("sim")
    if sim and overlay is not None:
        tree = merge(tree, overlay)
    tree = without_nulls(tree)
    problems = part_problems(tree)
    try:
        profile = Profile.model_validate(with_absolute_paths(tree))
    except ValidationError as error:
        problems = [*problems_of(error, tree, Profile), *problems]
    else:
        if not problems:
            return profile
    raise _all_at_once(problems)


def find_profile(name_or_path: str | Path) -> Path:
    """Return the path of a profile's file.

    Raises
    ------
    ProfileError
        No such file, or no profile of this name.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or "/" in text or text.endswith((".yaml", ".yml")):
        return Path(name_or_path)
    shipped = {entry.name: entry.path for entry in _shipped()}
    if text in shipped:
        return shipped[text]
    entries = list_profiles()
    found = next((entry.path for entry in entries if entry.name == text), None)
    if found is None:
        names = [entry.name for entry in entries]
        close = get_close_matches(text, names, 1)
        hint = f"did you mean {close[0]!r}? " if close else ""
        raise ProfileError(
            f"there is no profile {text!r}; {hint}There are {', '.join(names)}, and a file is "
            f"named by its path (ending in .yaml)"
        )
    return found


def list_profiles() -> list[ProfileEntry]:
    """List the shipped profiles and those of plugins."""
    from tactile_core.plugins import profile_directories

    entries = _shipped()
    for plugin, directory in profile_directories().items():
        entries += _in_directory(directory, f"plugin {plugin}")
    return entries


def profile_hash(profile: Profile) -> str:
    """Fingerprint of what a calibration depends on: image, light and printed marks."""
    matters = {
        "image": profile.image.model_dump(mode="json"),
        "illumination": profile.illumination.model_dump(mode="json"),
        "markers": profile.gel.model_dump(mode="json")["markers"],
    }
    text = json.dumps(matters, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _shipped() -> list[ProfileEntry]:
    import sensor_profiles

    return _in_directory(sensor_profiles.DIRECTORY, "shipped")


def _in_directory(directory: Path, origin: str) -> list[ProfileEntry]:
    return [ProfileEntry(path.stem, path, origin) for path in sorted(directory.glob("*.yaml"))]


def _extended(name: str, place: Place) -> Path:
    """Find what ``extends`` names; paths are relative to the file that names them."""
    try:
        found = find_profile(name)
    except ProfileError as error:
        problem = Problem(place, "extends", str(error))
        raise ProfileError(str(problem), [problem]) from None
    if name.endswith((".yaml", ".yml")) or "/" in name:
        found = place.file.parent / found
        if not found.is_file():
            problem = Problem(place, "extends", f"there is no file {found}")
            raise ProfileError(str(problem), [problem])
    return found


def _all_at_once(problems: Iterable[Problem]) -> ProfileError:
    ordered = sorted(
        set(problems), key=lambda p: (str(p.place.file), p.place.line, p.place.column, p.key)
    )
    count = len(ordered)
    head = "1 mistake" if count == 1 else f"{count} mistakes"
    return ProfileError(f"{head} in the profile:\n" + "\n".join(map(str, ordered)), ordered)
