"""The profile of a new sensor, and the place for it."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.files import plain_text, remove_leftovers, write_atomically
from tactile_core.formats.folders import make_folder
from tactile_core.formats.text import printable
from tactile_core.profiles.model import Profile
from tactile_core.recordings.inputs import Inputs
from tactile_core.scaffold.markers import PictureFinding


def refuse_existing(path: Path, *, force: bool, folder: bool = False) -> None:
    """Refuse a path that exists already.

    Parameters
    ----------
    path : Path
    force : bool
        True allows to replace a file by a file, and files of the same names in a folder.
    folder : bool
        True if a folder is to be written.

    Raises
    ------
    InputError
        The path exists without ``force``, is of the other kind, or leads through a missing folder.
    """
    if not os.path.lexists(path):
        place = Path(os.path.realpath(path))
        if os.path.lexists(place):  # once the missing folders have been created
            raise InputError(f"{path} leads through a folder that is not there; give {place}")
        return
    same_kind = path.is_dir() if folder else path.is_file()
    if not same_kind:
        raise InputError(
            f"{path} is {'no folder' if folder else 'no file'}; give another --out, the "
            f"{'folder' if folder else 'file'} to write"
        )
    if not force:
        raise InputError(f"{path} exists already; give another --out, or --force to replace it")


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
    """A profile, ready to be written.

    Attributes
    ----------
    name : str
    text : str
        YAML.
    notes : tuple of str
        Messages to the user about values that are inherited instead of measured.
    extends : str
        Value of ``extends`` in the text.
    own_files : tuple of Path
        The parent's file, and the files that it extends by path; empty for a parent by name.
    inputs : Inputs
        Files that it was made from; they are never overwritten.
    """

    name: str
    text: str
    notes: tuple[str, ...] = ()
    extends: str = ""
    own_files: tuple[Path, ...] = ()
    inputs: Inputs = field(default_factory=Inputs)

    def write(self, path: Path, *, force: bool = False) -> None:
        """Write the file, completely or not at all.

        Raises
        ------
        InputError
            The file exists without ``force``, or is an input of the profile.
        """
        path = Path(path)
        refuse_existing(path, force=force)
        self.inputs.refuse_file(path)
        make_folder(path.parent)
        remove_leftovers(path.parent)
        write_atomically(path, plain_text(self.text).encode("utf-8"))


def render_profile(
    name: str, extends: str, parent: Profile, source: str, findings: Sequence[PictureFinding]
) -> str:
    """Return the text of a profile: the differences from the parent, with comments on their origin.

    Parameters
    ----------
    name, extends : str
    parent : Profile
    source : str
        The image's name.
    findings : sequence of PictureFinding
    """
    lines = [
        *_comment(f"{name}: made by 'tactile new' from {parent.name} and {source}."),
        *_comment(
            f"The file holds the differences from {parent.name}; comments explain their origin. "
            f"Correct the values if necessary, then run 'tactile validate' on this file."
        ),
        *_comment("All other keys are inherited from this profile."),
        f"extends: {extends}",
        f"name: {name}",
        *_comment("Any text that distinguishes one build from the next."),
        'revision: "1"',
        f"description: Made from {parent.name}; describe the sensor here in one sentence",
    ]
    for section, unseen in _unseen(parent).items():
        lines += _section(section, findings, unseen, parent.name)
    lines += _section("camera", findings, {}, parent.name)
    return "\n".join(lines) + "\n"


def unseen_note(parent: Profile) -> str:
    """Return the message about keys that an image does not show and that are inherited."""
    inherited = ", ".join(
        f"{section}.{key} {_flow(value)}"
        for section, values in _unseen(parent).items()
        for key, value in values.items()
    )
    return f"an image does not show these values, so {parent.name}'s are used: {inherited}"


def _unseen(parent: Profile) -> dict[str, dict[str, Any]]:
    gel = {key: getattr(parent.gel, key) for key in _UNSEEN_GEL}
    present = {key: value for key, value in gel.items() if value is not None}
    return {"image": {"transfer": parent.image.transfer}, "gel": present}


def _section(
    name: str, findings: Iterable[PictureFinding], unseen: Mapping[str, Any], parent: str
) -> list[str]:
    """Return the lines of one section: findings, then inherited keys as comments."""
    inside: list[str] = []
    own = [finding for finding in findings if finding.section == name]
    for finding in own:
        inside += _comment(finding.comment)
        for key, value in finding.values.items():
            inside += _entry(key, value)
    if unseen:
        inside += _comment(
            f"An image does not show these values: {parent}'s are used until you remove the '#'."
        )
        inside += [f"# {key}: {_flow(value)}" for key, value in unseen.items()]
    if not inside:
        return []
    if not any(finding.values for finding in own):
        return ["", f"# {name}:", *(f"#   {line.removeprefix('# ')}" for line in inside)]
    return ["", f"{name}:", *(f"  {line}" for line in inside)]


def _entry(key: str, value: Any) -> list[str]:
    if isinstance(value, Mapping) and any(isinstance(v, list) for v in value.values()):
        return [f"{key}:", *(f"  {k}: {_flow(v)}" for k, v in value.items())]
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
    # YAML knows more line breaks than Python; after one of them the comment would end
    # [characters] of a line of 100
    lines = textwrap.wrap(printable(text), 100 - 4, break_on_hyphens=False)
    return [f"# {line}" for line in lines]
