"""Finds profiles by name: those shipped with the core and those of plugins."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from tactile_core.errors import InputError, Place, ProfileError
from tactile_core.formats.files import expand_home, is_file
from tactile_core.formats.json import shorten_repr
from tactile_core.profiles.yaml_tree import problem_at, read_yaml

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
        hint = f"for the file here write {file!r}. "
    else:
        hint = f"did you mean {close[0]!r}? " if close else ""
    return (
        f"there is no profile {shorten_repr(name)}; {hint}There are {', '.join(known)}, and a file "
        f"is named by its path (ending in .yaml)"
    )


def shipped_profiles() -> list[ProfileEntry]:
    """List the profiles of the core, without importing a plugin."""
    import sensor_profiles

    return _in_directory(sensor_profiles.DIRECTORY, "shipped")


def _in_directory(directory: Path, origin: str) -> list[ProfileEntry]:
    return [ProfileEntry(path.stem, path, origin) for path in sorted(directory.glob("*.yaml"))]
