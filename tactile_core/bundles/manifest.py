"""The manifest of a bundle: what it holds, and for which sensor it holds."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    PositiveInt,
    model_validator,
)

from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.files import plain_text, write_atomically
from tactile_core.formats.text import printable

Pairs = tuple[tuple[FiniteFloat, FiniteFloat], ...]
Size = Annotated[FiniteFloat, Field(ge=0)]
Text = Annotated[str, BeforeValidator(lambda v: plain_text(v) if isinstance(v, str) else v)]


class LightRange(BaseModel):
    """What is normal for a unit: frames are compared with its reference within these limits.

    K channels have K − 2 combinations that no tilt of the surface changes.

    Attributes
    ----------
    response : (K, 2)
        Change of the logarithm of each channel per slope along x and y.
    drift : (K − 2, 2)
        Mean linear change of these combinations against the reference, per half of the image along
        x and y.
    ramp, field : float
        Largest root mean square of a linear change beyond the drift, and of one of third order.
    agreement : float
        Least share of the image whose change is explained by tilt and a change of third order.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    response: Pairs
    drift: Pairs
    ramp: Size
    field: Size
    agreement: Size


class Imported(BaseModel):
    """Where a light model comes from that this program has not fitted.

    Attributes
    ----------
    kind : str
        ``plugin.name`` of the importer that read it.
    file : str
        Name of the file.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    kind: Text
    file: Text


class Starting(BaseModel):
    """A calibration of a design: it measures every unit coarsely before that is calibrated.

    Attributes
    ----------
    of : str
        What it was fitted to, in words.
    flip, rotate_deg
        How the design turns the camera's image, and so where the lights are in it.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    of: Text
    flip: Text = "none"
    rotate_deg: int = 0


FORMAT = 5  # Version of the bundle format that is written and read

MANIFEST = "manifest.json"  # File name of the manifest

LIGHT = "light"  # Name of the artefact that maps intensities to slopes or depth

# Name of the artefact with the size of its errors; a bundle without a score has none.
ERRORS = "errors"

_LARGEST_BYTES = 4 << 20  # A larger manifest is refused before it is parsed

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Versioned(BaseModel):
    model_config = ConfigDict(strict=True)

    format: int


def _not_empty(artefacts: dict[str, str]) -> dict[str, str]:
    if not artefacts:
        raise ValueError("a bundle holds an artefact")
    return artefacts


class Manifest(BaseModel):
    """The unit that a bundle belongs to, its accuracy and its files; stored as ``manifest.json``.

    Attributes
    ----------
    artefacts : dict
        ``plugin.name`` of each artefact's class, by the artefact's name. The name is also that of
        the artefact's folder. The light model has the name :data:`LIGHT`; a bundle without it
        holds models of steps.
    measured_with : str
        How the ball's diameter and the scale were measured, in the user's words; empty if unknown.
    imported : Imported or None
        Where the light model comes from; None if it was fitted to presses. An imported one has no
        score: ``held_out`` is None.
    starting : Starting or None
        Of a starting calibration; None for the calibration of a unit.
    light_range : LightRange or None
        What is normal for the light of this unit; None if it was not observed.
    doubts : tuple of str
        What contradicted the calibration when it was made; every use repeats it.
    files : dict
        SHA-256 of every other file of the bundle, by its path in the folder.
    content_hash : str
        SHA-256 of all other fields in the file. It covers the files through their hashes.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    format: int = Field(default=FORMAT, ge=FORMAT, le=FORMAT)
    profile: Text
    revision: Text = ""
    serial: Text = ""
    gel_id: Text = ""
    artefacts: Annotated[dict[Name, Text], AfterValidator(_not_empty)]
    image_size_px: tuple[PositiveInt, PositiveInt]
    crop: tuple[int, int, int, int] | None = None
    channels: tuple[Text, ...]
    channel_azimuth_deg: tuple[float, ...] = ()
    mm_per_px: Positive
    bit_depth: int = Field(default=8, ge=1, le=16)
    exposure: dict[str, Any] | None = None
    created: Text = ""
    ball_diameters_mm: tuple[Positive, ...] = ()
    measured_with: Text = ""
    presses_used: int = Field(default=0, ge=0)
    held_out: dict[str, Any] | None = None
    imported: Imported | None = None
    starting: Starting | None = None
    light_range: LightRange | None = None
    doubts: tuple[Text, ...] = ()
    versions: dict[str, Text] = {}
    profile_hash: str = ""
    files: dict[str, str] = {}
    content_hash: str = ""

    @model_validator(mode="after")
    def _light_of_these_channels(self) -> Self:
        light = self.light_range
        if light and not len(light.response) == len(light.drift) + 2 == len(self.channels):
            raise ValueError("'light_range' is of other channels")
        return self

    @property
    def model(self) -> str:
        """``plugin.name`` of the light model; empty if there is none."""
        return self.artefacts.get(LIGHT, "")

    def fingerprint(self) -> str:
        """Return the SHA-256 of all fields except ``content_hash``, as JSON with sorted keys.

        A field that a manifest of an earlier version lacks is left out.
        """
        plain = json.loads(self.model_dump_json(exclude={"content_hash"}, exclude_unset=True))
        return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def is_measured(folder: Path) -> bool:
    """Whether a folder holds a bundle that was not imported, or one that cannot be read."""
    try:
        return read_manifest(folder).imported is None
    except CalibrationError:  # perhaps of an older version
        return (folder / MANIFEST).exists()


def read_manifest(folder: Path) -> Manifest:
    """Read a bundle's manifest, without checking the files that it lists.

    Raises
    ------
    CalibrationError
        The manifest is missing, damaged, edited, or of another format.
    """
    manifest = _parse_manifest(folder)
    if manifest.content_hash != manifest.fingerprint():
        raise _report_damage(folder)
    return manifest


def _parse_manifest(folder: Path) -> Manifest:
    try:
        text = _read(folder / MANIFEST)
        written = _Versioned.model_validate_json(text).format
        if written == FORMAT:
            return Manifest.model_validate_json(text)
    except (FileNotFoundError, NotADirectoryError):
        raise CalibrationError(
            f"{folder} is no calibration bundle (it has no {MANIFEST}); "
            f"'tactile calibrate … --out {folder}' makes one"
        ) from None
    except (ValueError, OSError) as error:
        raise _report_damage(folder) from error
    if written > FORMAT:
        raise CalibrationError(
            f"bundle {folder}: format {written} is newer than this version reads ({FORMAT}); "
            f"upgrade tactile-core"
        )
    raise CalibrationError(
        f"bundle {folder}: format {written} is older than this version reads ({FORMAT}); move the "
        f"folder away and calibrate again"
    )


def _report_damage(folder: Path) -> CalibrationError:
    return CalibrationError(
        f"bundle {folder}: {MANIFEST} is damaged or was edited; calibrate again, or restore the "
        f"bundle from a copy"
    )


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write the manifest of all files that the folder holds."""
    files = {
        name: _hash(folder / name) for name in sorted(_list_entries(folder)) if name != MANIFEST
    }
    # hash the manifest as it will be read: JSON does not preserve every value
    update: dict[str, Any] = {"format": FORMAT, "files": files, "content_hash": ""}
    whole = Manifest.model_validate_json(manifest.model_copy(update=update).model_dump_json())
    whole = whole.model_copy(update={"content_hash": whole.fingerprint()})
    text = whole.model_dump_json(indent=2) + "\n"
    write_atomically(folder / MANIFEST, text.encode("utf-8"))


def check_files(folder: Path, manifest: Manifest) -> None:
    """Check that every file of the manifest is present and unchanged.

    Raises
    ------
    CalibrationError
        A file is missing or differs; the message names it.
    """
    for name, written in manifest.files.items():
        try:
            # what is outside of the folder was not written with it, whatever it holds
            inside = not (name.startswith("/") or ".." in name.split("/"))
            whole = inside and _hash(folder / name) == written
        except (OSError, ValueError):
            whole = False
        if not whole:
            raise CalibrationError(
                f"bundle {folder}: {name} is not the file that was written (damaged, edited or "
                f"missing); calibrate again or restore the bundle from a copy"
            )


def bundle_files(folder: Path) -> list[Path]:
    """Return the files of a bundle's folder, the manifest last; none for an empty folder.

    Raises
    ------
    InputError
        The folder is not a bundle, or holds something that its manifest does not list.
    """
    if not folder.exists():
        return []
    if not folder.is_dir():
        raise InputError(f"{folder} is a file; name a folder for the bundle")
    if not any(folder.iterdir()):
        return []
    try:
        named = {*_parse_manifest(folder).files, MANIFEST}
    except CalibrationError as error:
        raise InputError(
            f"{folder} exists and is not a calibration bundle that may be replaced; move it away "
            f"or name another --out folder"
        ) from error
    held = set(_list_entries(folder))
    for name in sorted(held):
        if name not in named or (folder / name).is_dir():
            raise InputError(
                f"{folder} holds {printable(name)}, which is not part of the calibration bundle "
                f"there; move it away or name another --out folder"
            )
    return [*(folder / name for name in held - {MANIFEST}), folder / MANIFEST]


def _list_entries(folder: Path, below: str = "") -> Iterator[str]:
    """Yield the paths of all files and of all empty folders, with ``/`` between their parts."""
    with os.scandir(folder) as entries:
        for entry in entries:
            name = below + entry.name
            if not entry.is_dir(follow_symlinks=False):
                yield name
                continue
            inside = list(_list_entries(Path(entry.path), f"{name}/"))
            yield from inside or [name]


def _read(path: Path) -> bytes:
    if path.exists() and not path.is_file():
        raise ValueError("not a file")
    with path.open("rb") as file:
        text = file.read(_LARGEST_BYTES + 1)
    if len(text) > _LARGEST_BYTES:
        raise ValueError("too long")
    return text


def _hash(path: Path) -> str:
    if not path.is_file():
        raise FileNotFoundError(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
