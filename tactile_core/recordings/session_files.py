"""The files of a session of several sensors, and their names."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.catalog import hide_secrets
from tactile_core.formats.npz import npz_arrays, npz_bytes, reference_arrays, reference_of
from tactile_core.formats.text import yaml_text
from tactile_core.formats.yaml_tree import mapping_of
from tactile_core.interfaces.recording_writer import RecordedSession
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference

# Names of the files of a session; those of the bundle begin with `bundle/`.
SESSION, PROFILE, REFERENCE, BUNDLE = "session.json", "profile.yaml", "reference.npz", "bundle/"

# Name of the list of images and events in a folder; it makes the folder a recording.
LIST = "recording.jsonl"

ESSENTIAL = SESSION, PROFILE  # Files without which no image can be measured

# Names of files in a bundle that are safe to create.
_NAME = re.compile(r"[\w+-][\w.+-]*(?:/[\w+-][\w.+-]*)*", re.ASCII)

# Attributes of a session with a file of their own.
_IN_FILES = frozenset({"profile", "reference", "bundle"})


def session_files(session: RecordedSession) -> dict[str, bytes]:
    """Return the files of a session by name."""
    values = {f.name: getattr(session, f.name) for f in fields(session) if f.name not in _IN_FILES}
    values["channels"] = list(session.channels)
    values["software"] = dict(session.software)
    values["damaged"] = list(session.damaged)
    files = {SESSION: b"", PROFILE: session.profile.encode()}
    if session.reference is not None:
        files[REFERENCE] = reference_bytes(session.reference)
    for name, content in (session.bundle or {}).items():
        files[BUNDLE + name] = content
    values["files"] = list(files)
    return {**files, SESSION: json.dumps(values, indent=1).encode()}


def session_of(files: Mapping[str, bytes], path: Path) -> RecordedSession:
    """Return the session of a recording from its files.

    Parameters
    ----------
    files : mapping of str to bytes
    path : Path
        The recording, in messages.

    Raises
    ------
    InputError
        A file is damaged, or one of :data:`ESSENTIAL` is missing.
    """
    try:
        values = json.loads(files[SESSION])
        missing = {str(name) for name in values.get("files", ())} - set(files)
        lost = {"reference" if name == REFERENCE else "bundle" for name in missing}
        damaged = tuple(sorted(lost | set(map(str, values.get("damaged", ())))))
        session = RecordedSession(
            profile=files[PROFILE].decode(),
            sensor=str(values["sensor"]),
            channels=tuple(str(name) for name in values["channels"]),
            exposures=int(values["exposures"]),
            sim=bool(values["sim"]),
            serial=_text(values["serial"]),
            gel=_text(values["gel"]),
            software={str(name): str(version) for name, version in values["software"].items()},
            started=str(values["started"]),
            tared=bool(values.get("tared", False)),
            damaged=damaged,
            bundle={
                name.removeprefix(BUNDLE): content
                for name, content in files.items()
                if name.startswith(BUNDLE) and "bundle" not in damaged
            }
            or None,
            reference=(reference_from(files[REFERENCE], path) if REFERENCE in files else None),
        )
        if session.exposures < 1:
            raise ValueError(session.exposures)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            f"{path} does not say which sensor recorded it, because its beginning is damaged or "
            f"another program wrote it; record with 'tactile record', or save its images as PNG"
        ) from error
    return session


def reference_bytes(reference: Reference) -> bytes:
    """Return a reference as the content of an ``.npz`` file."""
    return bytes(npz_bytes(reference_arrays(reference), REFERENCE))


def reference_from(data: bytes, path: Path) -> Reference:
    """Return the reference in the content of an ``.npz`` file.

    Raises
    ------
    InputError
        It is damaged.
    """
    try:
        return reference_of(npz_arrays(data, f"the reference in {path}"))
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise InputError(f"the reference in {path} is damaged; give --reference") from error


def own_reference(session: RecordedSession, path: Path) -> Reference | None:
    """Return the reference in a recording; None if it has none.

    Raises
    ------
    InputError
        It is damaged.
    """
    if "reference" in session.damaged:
        raise InputError(f"the reference in {path} is damaged; give --reference")
    return session.reference


def taken_reference(session: RecordedSession, path: Path) -> Reference | None:
    """Return the reference in a recording, unless it is merely the first image; else None.

    Raises
    ------
    InputError
        It is damaged.
    """
    reference = own_reference(session, path)
    return None if reference is None or reference.relative else reference


def profile_text(profile: Profile) -> str:
    """Return a profile as YAML that needs no other file, without secrets in addresses."""
    # the recording has the bundle itself
    values = profile.model_dump(mode="json", by_alias=True, exclude={"starting_bundle"})
    return yaml_text(hide_secrets(values))


def profile_of(session: RecordedSession, path: Path) -> Profile:
    """Return the profile that a recording was made with.

    Raises
    ------
    InputError
        It is damaged, or a newer version wrote it.
    """
    try:
        return Profile.model_validate(mapping_of(session.profile, path))
    except (ValueError, InputError) as error:
        raise InputError(
            f"the profile in {path} is damaged or of a newer version of tactile-core; copy the "
            f"recording again, or update tactile-core"
        ) from error


def bundle_content(bundle: Bundle) -> dict[str, bytes]:
    """Return the content of the files that a bundle saves."""
    with TemporaryDirectory(prefix="tactile-") as folder:
        place = Path(folder, "bundle")
        bundle.save(place)
        return {
            path.relative_to(place).as_posix(): path.read_bytes()
            for path in sorted(place.rglob("*"))
            if path.is_file()
        }


def bundle_of(session: RecordedSession, path: Path) -> Bundle | None:
    """Return the bundle in a recording; None if it has none.

    Raises
    ------
    InputError, CalibrationError
        It is damaged, or of another version.
    """
    if "bundle" in session.damaged:
        raise InputError(f"the bundle in {path} is damaged; give --bundle")
    if session.bundle is None:
        return None
    with TemporaryDirectory(prefix="tactile-") as folder:
        place = Path(folder, "bundle")
        for name, content in session.bundle.items():
            if not _NAME.fullmatch(name):
                raise InputError(f"the bundle in {path} is damaged; give --bundle")
            file = place / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        try:
            return Bundle.load(place)
        except CalibrationError as error:
            why = str(error).removeprefix(f"bundle {place}: ").replace(f"{place}/", "")
            raise CalibrationError(
                f"the bundle in {path} cannot be used ({why.partition(';')[0]}); give --bundle"
            ) from error


def _text(value: Any) -> str | None:
    return None if value is None else str(value)


T = TypeVar("T")

_SUFFIX = re.compile(r"\.[a-z]\w*$", re.IGNORECASE)
_WHOLE = re.compile(r"([0-9]+)")
_DECIMAL = re.compile(r"([0-9]+(?:[.,][0-9]+)?)")
_FRACTION = re.compile(r"[0-9]+[.,]([0-9]+)")
_SECONDS = re.compile(r"(?:t|time)?[ _=-]?([0-9]+(?:[.,][0-9]+)?)s?", re.IGNORECASE)
_EPOCH = re.compile(r"(.*?)(?<![0-9.,])([0-9]{13}|[0-9]{16}|[0-9]{19})(?![0-9.,])(.*)")
# The years 2000 to 2100, of which integers are the times since 1970.
_EPOCH_YEARS_S = 946_684_800, 4_102_444_800


def sorted_by_name(items: Iterable[T], name: Callable[[T], str]) -> list[T]:
    """Sort by the numbers in names: ``2`` before ``10``, ``12.04`` before ``12.2``, and a copy
    such as ``2 (1)`` after its original.

    Parameters
    ----------
    items : iterable
    name : callable
        Returns the name of an item, with or without a suffix.
    """
    items = list(items)
    decimal = _are_decimals(map(name, items))

    def key(item: T) -> tuple[list[str | Decimal], str]:
        stem = _SUFFIX.sub("", name(item)).casefold()
        parts = (_DECIMAL if decimal else _WHOLE).split(stem)
        return [_number(part) if i % 2 else part for i, part in enumerate(parts)], name(item)

    return sorted(items, key=key)


def times_of(stems: Sequence[str]) -> tuple[float, ...] | None:
    """Return the times that names of images give, s; None if these are no times.

    Times are a rising run of decimal numbers of seconds (``12.04``, ``t12.2``), or of integers of
    13, 16 or 19 digits: milliseconds, microseconds or nanoseconds since 1970, all behind the same
    word.
    """
    times = _seconds(stems) or _since_1970(stems)
    if times is None or any(b <= a for a, b in pairwise(times)):
        return None
    return times


def _seconds(stems: Sequence[str]) -> tuple[float, ...] | None:
    found = [_SECONDS.fullmatch(stem) for stem in stems]
    if not any(map(_FRACTION.search, stems)) or not _are_decimals(stems):
        return None
    times = tuple(float(_number(one[1])) for one in found if one is not None)
    return times if len(times) == len(stems) > 1 else None


def _since_1970(stems: Sequence[str]) -> tuple[float, ...] | None:
    found = [one for stem in stems if (one := _EPOCH.fullmatch(stem)) is not None]
    if len({(one[1], len(one[2]), one[3]) for one in found}) != 1 or not 1 < len(found) == len(
        stems
    ):
        return None
    units = 10 ** (len(found[0][2]) - 10)
    times = tuple(int(one[2]) / units for one in found)
    return times if _EPOCH_YEARS_S[0] <= times[0] <= times[-1] <= _EPOCH_YEARS_S[1] else None


def _are_decimals(names: Iterable[str]) -> bool:
    """Whether ``1.2`` is a decimal number, not a 1 and a 2 as in ``1.9`` before ``1.10``.

    Decimals are printed with equally many digits, or without the last zeros.
    """
    stems = (_SUFFIX.sub("", name) for name in names)
    fractions = {one for stem in stems for one in _FRACTION.findall(stem)}
    equal = len(set(map(len, fractions))) == 1
    return equal or not any(one.endswith("0") and one != "0" for one in fractions)


def _number(part: str) -> Decimal:
    return Decimal(part.replace(",", "."))
