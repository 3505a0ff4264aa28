"""A profile for a lab's own sensor, as text with a comment to every line."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactile_core.formats.files import plain_text, write_atomically
from tactile_core.formats.folders import make_folder
from tactile_core.formats.printable import printable
from tactile_core.formats.unfinished import remove_leftovers
from tactile_core.profiles.model import Profile
from tactile_core.recordings.inputs import Inputs
from tactile_core.scaffold.finding import Finding
from tactile_core.scaffold.place import refuse_existing

_WIDTH = 100
_UNSEEN_GEL = (
    "shape",
    "radius_mm",
    "thickness_mm",
    "shear_modulus_mpa",
    "poisson_ratio",
    "friction",
    "coating",
)


@dataclass(frozen=True)
class NewProfile:
    """A profile that was made, not written yet.

    Attributes
    ----------
    name : str
    text : str
        YAML.
    notes : tuple of str
        What was not found but taken from the parent.
    extends_path : bool
        Whether the parent is a file and no name.
    inputs : Inputs
        What it was made from, which it does not replace.
    """

    name: str
    text: str
    notes: tuple[str, ...] = ()
    extends_path: bool = False
    inputs: Inputs = field(default_factory=Inputs)

    def write(self, path: Path, *, force: bool = False) -> None:
        """Write the file, whole or not at all.

        Raises
        ------
        InputError
            There is such a file, and not ``force``; or it is one that this was made from.
        """
        path = Path(path)
        refuse_existing(path, force=force)
        self.inputs.refuse_file(path)
        make_folder(path.parent)
        remove_leftovers(path.parent)
        write_atomically(path, plain_text(self.text).encode("utf-8"))


def render_profile(
    name: str, extends: str, parent: Profile, source: str, findings: Sequence[Finding]
) -> str:
    """Write what differs from the parent, each with how it was found.

    Parameters
    ----------
    name, extends : str
    parent : Profile
    source : str
        The picture's name.
    findings : sequence of Finding
    """
    lines = [
        *_comment(f"{name}: made by 'tactile new' from {parent.name} and {source}."),
        *_comment(
            f"Only what differs from {parent.name} is said; the comments tell how it was found. "
            f"Correct what you know better, then run 'tactile validate' on this file."
        ),
        *_comment("All that is not said here is this profile's."),
        f"extends: {extends}",
        f"name: {name}",
        *_comment("Your own words, to tell one build from the next."),
        'revision: "1"',
        f"description: Made from {parent.name}; say here in a sentence what it is",
    ]
    for section, unseen in _unseen(parent).items():
        lines += _section(section, findings, unseen, parent.name)
    lines += _section("illumination", findings, {}, parent.name)
    return "\n".join(lines) + "\n"


def unseen_note(parent: Profile) -> str:
    """Say what a picture does not show, and that it is the parent's."""
    said = ", ".join(
        f"{section}.{key} {_flow(value)}"
        for section, values in _unseen(parent).items()
        for key, value in values.items()
    )
    return f"a picture does not show these, so they are {parent.name}'s: {said}"


def _unseen(parent: Profile) -> dict[str, dict[str, Any]]:
    gel = {key: getattr(parent.gel, key) for key in _UNSEEN_GEL}
    told = {key: value for key, value in gel.items() if value is not None}
    return {"image": {"transfer": parent.image.transfer}, "gel": told}


def _section(
    name: str, findings: Iterable[Finding], unseen: Mapping[str, Any], parent: str
) -> list[str]:
    """Lines of one section: what was found, then, as comments, what a picture does not show."""
    inside: list[str] = []
    here = [finding for finding in findings if finding.section == name]
    for finding in here:
        inside += _comment(finding.comment)
        for key, value in finding.values.items():
            inside += _entry(key, value)
    if unseen:
        inside += _comment(
            f"A picture does not show these: they are {parent}'s until you take the '#' away."
        )
        inside += [f"# {key}: {_flow(value)}" for key, value in unseen.items()]
    if not inside:
        return []
    said = any(finding.values for finding in here)
    if not said:
        return ["", f"# {name}:", *(f"#   {line.removeprefix('# ')}" for line in inside)]
    return ["", f"{name}:", *(f"  {line}" for line in inside)]


def _entry(key: str, value: Any) -> list[str]:
    if isinstance(value, Mapping) and any(isinstance(v, list) for v in value.values()):
        return [f"{key}:", *(f"  {k}: {_flow(v)}" for k, v in value.items())]
    if isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        return [f"{key}:", *(f"  - {_flow(item)}" for item in value)]
    return [f"{key}: {_flow(value)}"]


def _flow(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    return f"{value:g}" if isinstance(value, float) and abs(value) < 1e5 else str(value)


def _comment(text: str) -> list[str]:
    # a line that ends where YAML sees an end, and Python none, would be no comment any more
    lines = textwrap.wrap(printable(text), _WIDTH - 4, break_on_hyphens=False)
    return [f"# {line}" for line in lines]
