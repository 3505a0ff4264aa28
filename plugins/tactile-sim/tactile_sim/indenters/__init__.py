"""Indenters: objects to press into the virtual sensor, by name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from numbers import Real
from typing import Any

from tactile_core.errors import InputError
from tactile_sim.indenters.mesh import HeightMapIndenter, mesh_indenter
from tactile_sim.indenters.relief import TEXTURES, Textured
from tactile_sim.indenters.solids import Cone, Cylinder, Flat, Indenter, Sphere
from tactile_sim.indenters.textures import Cloth, Coin, Screw, letters

KINDS: dict[str, Callable[..., Indenter]] = {
    "sphere": Sphere,
    "cylinder": Cylinder,
    "flat": Flat,
    "cone": Cone,
    "heightmap": HeightMapIndenter,
    "mesh": mesh_indenter,
    "coin": Coin,
    "screw": Screw,
    "letters": letters,
    "cloth": Cloth,
}

__all__ = ["KINDS", "TEXTURES", "Indenter", "make_indenter"]


def make_indenter(
    kind: str,
    *,
    texture: Mapping[str, Any] | None = None,
    **options: Any,
) -> Indenter:
    """Make an indenter by the name of its kind.

    Parameters
    ----------
    kind : str
        One of :data:`KINDS`.
    texture : mapping, optional
        Texture of its surface: ``kind``, one of :data:`TEXTURES`, and its options, for example
        ``{"kind": "ribs", "pitch_mm": 1.0, "relief_mm": 0.1}``.
    **options
        Options of the kind, in mm and degrees.

    Raises
    ------
    InputError
        Unknown kind or option, a missing option, or an invalid size.
    """
    made: Indenter = _make_shape("indenter", KINDS, kind, options)
    if texture is not None:
        if not isinstance(texture, Mapping) or not isinstance(texture.get("kind"), str):
            raise InputError(f"a texture needs its kind: {', '.join(TEXTURES)}")
        sizes = {name: value for name, value in texture.items() if name != "kind"}
        made = Textured(made, _make_shape("texture", TEXTURES, texture["kind"], sizes))
    return made


def _make_shape(
    what: str, kinds: Mapping[str, Callable[..., Any]], kind: str, options: Mapping[str, Any]
) -> Any:
    if kind not in kinds:
        close = get_close_matches(kind, kinds, 1)
        hint = f"; do you mean {close[0]!r}?" if close else ""
        raise InputError(f"there is no {what} {kind!r}, but {', '.join(kinds)}{hint}")
    accepted = inspect.signature(kinds[kind]).parameters
    for name, value in options.items():
        if name not in accepted:
            raise InputError(f"a {kind} has no option {name!r}, but {', '.join(accepted)}")
        annotation = str(accepted[name].annotation)
        if value is not None and annotation.startswith("float") and not _is_number(value):
            raise InputError(f"a {kind}'s {name} should be a number, not {value!r}")
        if annotation == "str" and not isinstance(value, str):
            raise InputError(f"a {kind}'s {name} should be text, so write {value!r} in quotes")
        if value is not None and annotation.startswith("tuple") and not _is_pair(value):
            raise InputError(f"a {kind}'s {name} should be two numbers, not {value!r}")
    for name, parameter in accepted.items():
        if parameter.default is parameter.empty and name not in options:
            raise InputError(f"a {kind} needs {name}")
    return kinds[kind](**options)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(_is_number, value))
