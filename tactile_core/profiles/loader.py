"""From a profile's name or path to a validated :class:`Profile`, or every mistake in it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tactile_core.errors import Place, Problem
from tactile_core.profiles.components import check_components
from tactile_core.profiles.components import validate_components as validate_components
from tactile_core.profiles.model import Profile
from tactile_core.profiles.names import ProfileEntry as ProfileEntry
from tactile_core.profiles.names import find_extended, find_profile
from tactile_core.profiles.names import list_profiles as list_profiles
from tactile_core.profiles.names import list_rigs as list_rigs
from tactile_core.profiles.nodes import Node
from tactile_core.profiles.problems import MISSING, problems_of
from tactile_core.profiles.source import Source, read_source
from tactile_core.profiles.yaml_tree import refusal

_OVERRIDES = Place(Path("overrides"))
"""Where what a program lays over a profile "stands"; its paths are relative to here."""

_VIRTUAL: Mapping[str, Any] = {
    "camera": {"use": "core.virtual"},
    "image": {"crop": None, "lens": None, "warp": None, "flip": "none", "rotate_deg": 0},
}
"""The virtual twin of every profile: its camera sees the image as it is measured."""


def load_profile(
    name_or_path: str | Path,
    *,
    sim: bool = False,
    overrides: Mapping[str, Any] | None = None,
    components: bool = True,
) -> Profile:
    """Load a profile and validate it, with the components that it names.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped or plugin's profile by name, or the path of a YAML file.
    sim : bool
        The virtual twin: a virtual camera, and the profile's ``sim`` overlay over that.
    overrides : mapping, optional
        Laid over everything, by the rules of ``extends``: ``{"gel": {"friction": 0.3}}``.
    components : bool
        False looks at the profile alone: no plugin is imported, and the components' options are
        neither checked nor their relative paths resolved.

    Raises
    ------
    ProfileError
        With every mistake at once, each with file, line, column and key.
    """
    source = load_source(name_or_path, sim=sim, overrides=overrides)
    problems = [*source.problems, *validate_structure(source)]
    settings = source.settings.plain()
    if components:
        checked = check_components(source)
        problems += checked.problems
        settings = checked.settings
    if problems:
        raise refusal(problems)
    return Profile.model_validate(settings)


def load_source(
    name_or_path: str | Path, *, sim: bool = False, overrides: Mapping[str, Any] | None = None
) -> Source:
    """Read a profile and all that it extends, without judging it.

    Raises
    ------
    ProfileError
        There is no such profile, or nothing can be made of its file.
    """
    source = read_source(find_profile(name_or_path), find_extended)
    overlay = source.tree.get("sim")
    if sim:
        source = source.under(Node.of(_VIRTUAL, _OVERRIDES))
        if overlay is not None and overlay.is_mapping:
            source = source.under(overlay)
    if overrides:
        source = source.under(Node.of(overrides, _OVERRIDES))
    return source


def validate_structure(source: Source) -> list[Problem]:
    """Return what is wrong with a profile apart from its components, without importing a plugin.

    The ``sim`` overlay is judged by the profile that it makes.
    """
    problems = _mistakes(source)
    overlay = source.tree.get("sim")
    if overlay is not None and overlay.is_mapping:
        said = {(p.file, p.line, p.column) for p in problems}
        problems += [
            Problem(p.file, p.line, p.column, f"sim.{p.key}", p.message)
            for p in _mistakes(source.under(overlay))
            if (p.file, p.line, p.column) not in said
        ]
    return problems


def profile_hash(profile: Profile) -> str:
    """Fingerprint of what a calibration depends on.

    SHA-256, shortened to 16 digits, of the image section with its defaults, of the illumination
    as written but for what switches it, and of the gel's coating, markers and dome, as JSON with
    sorted keys. 19 and 19.0 are one number. The scale is left out: a recording may tell its own,
    and a bundle compares it apart.
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
        problems = problems_of(error, tree, Profile)
        # What a broken parent would have brought is not missing.
        return [p for p in problems if source.whole or p.message != MISSING]
    return []


def _canonical(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
