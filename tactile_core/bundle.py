"""The calibration bundle: one physical unit's model, reference and manifest in a folder."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from tactile_core.blame import blame
from tactile_core.calibration import Calibration
from tactile_core.errors import CalibrationError, InputError
from tactile_core.profiles.loader import profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference

FORMAT = 1
SCALE_TOLERANCE = 0.01
"""Scales of input and bundle may differ by this fraction."""

_SERIAL = re.compile(r"[A-Za-z0-9._-]+")


class Manifest(BaseModel):
    """What a bundle belongs to and how good it is; stored as ``manifest.json``."""

    model_config = ConfigDict(frozen=True)

    format: int = FORMAT
    profile: str
    revision: str = ""
    serial: str = ""
    gel_id: str = ""
    model: str
    image_size_px: tuple[int, int]
    crop: tuple[int, int, int, int] | None = None
    channels: tuple[str, ...]
    channel_azimuth_deg: tuple[float, ...] = ()
    mm_per_px: float
    bit_depth: int = 8
    exposure: dict[str, Any] | None = None
    created: str = ""
    ball_diameter_mm: float | None = None
    presses_used: int = 0
    held_out: dict[str, Any] | None = None
    versions: dict[str, str] = {}
    profile_hash: str = ""
    content_hash: str = ""


@dataclass(frozen=True, eq=False)
class Bundle:
    """A fitted calibration with all that it needs to be used again."""

    manifest: Manifest
    calibration: Calibration
    reference: Reference

    def save(self, directory: Path, report: Callable[[Path], None] | None = None) -> None:
        """Write the bundle whole or not at all; an older bundle there is replaced.

        Parameters
        ----------
        directory : Path
        report : callable, optional
            Writes more files (``report.html`` and its pictures) into the folder it is given.

        Raises
        ------
        InputError
            The folder holds something that is not a bundle.
        OSError
            The disk is full or refuses; what was there before is still there.
        """
        directory = Path(directory).resolve()
        if directory.exists() and not _is_replaceable(directory):
            raise InputError(
                f"{directory} exists and is not a calibration bundle; name another --out folder"
            )
        directory.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix=f".{directory.name}-", dir=directory.parent))
        try:
            with blame("the calibration", self.calibration):
                self.calibration.save(fresh)
            _save_reference(self.reference, fresh / "reference.npz")
            manifest = self.manifest.model_copy(update={"content_hash": _content_hash(fresh)})
            (fresh / "manifest.json").write_text(manifest.model_dump_json(indent=2) + "\n")
            if report is not None:
                report(fresh)
            fresh.chmod(0o755)
            _swap(fresh, directory)
        except BaseException:
            shutil.rmtree(fresh, ignore_errors=True)
            raise

    @classmethod
    def load(cls, directory: Path) -> Bundle:
        """Read a bundle and check that it is whole.

        Raises
        ------
        CalibrationError
            The folder is no bundle, is broken, or was written by a newer version.
        """
        from tactile_core.plugins import resolve

        directory = Path(directory)
        manifest = _read_manifest(directory)
        if manifest.content_hash != _content_hash(directory):
            raise CalibrationError(
                f"bundle {directory}: its files are not those that were written (damaged or "
                f"edited); calibrate again or restore it from a copy"
            )
        model = resolve("calibration", manifest.model)
        with blame("the calibration", model):
            calibration: Calibration = model.load(directory)
        return cls(manifest, calibration, _load_reference(directory / "reference.npz"))

    def check(self, profile: Profile, serial: str | None = None) -> list[str]:
        """Refuse a profile or unit that the bundle is not for; return warnings.

        Raises
        ------
        CalibrationError
            Another sensor, serial, image size, bit depth or scale.
        """
        mine, image = self.manifest, profile.image
        for what, ours, theirs in (
            ("sensor", mine.profile, profile.name),
            ("serial", mine.serial, serial if serial is not None else mine.serial),
            ("image size", mine.image_size_px, (image.width_px, image.height_px)),
            ("bit depth", mine.bit_depth, image.bit_depth),
        ):
            if ours != theirs:
                raise CalibrationError(
                    f"the bundle was made for {what} {_plain(ours)}, not {_plain(theirs)}; "
                    f"use the bundle of this sensor or run 'tactile calibrate'"
                )
        if abs(image.mm_per_px / mine.mm_per_px - 1) > SCALE_TOLERANCE:
            raise CalibrationError(
                f"the bundle was made at {mine.mm_per_px:g} mm per pixel and this input has "
                f"{image.mm_per_px:g}; calibrate at the scale of the input"
            )
        if mine.profile_hash != profile_hash(profile):
            return [
                "the profile's image, light or gel has changed since this bundle was made; "
                "calibrate again if readings look wrong"
            ]
        return []


def now() -> str:
    """Return the date and time for a manifest, ISO 8601 in UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def check_serial(serial: str) -> str:
    """Return the serial if it may name a folder.

    Raises
    ------
    InputError
        It has other characters than letters, digits, ``.``, ``_`` and ``-``.
    """
    if not _SERIAL.fullmatch(serial) or set(serial) == {"."}:
        raise InputError(f"serial {serial!r}: use only letters, digits, '.', '_' and '-'")
    return serial


def default_place(profile: Profile, serial: str | None) -> Path:
    """Folder in the user's data directory where the unit's bundle belongs."""
    from platformdirs import user_data_path

    return user_data_path("tactile-core") / "bundles" / profile.name / (serial or "default")


def _is_replaceable(directory: Path) -> bool:
    return (directory / "manifest.json").is_file() or (
        directory.is_dir() and not any(directory.iterdir())
    )


def _swap(fresh: Path, directory: Path) -> None:
    if not directory.exists():
        fresh.rename(directory)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{directory.name}-old-", dir=directory.parent))
    directory.rename(old / directory.name)
    try:
        fresh.rename(directory)
    except BaseException:
        (old / directory.name).rename(directory)
        raise
    finally:
        shutil.rmtree(old, ignore_errors=True)


def _content_hash(directory: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(directory.glob("*.npz")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _read_manifest(directory: Path) -> Manifest:
    path = directory / "manifest.json"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        written = data.get("format", 0)
        if isinstance(written, int) and written > FORMAT:
            raise CalibrationError(
                f"bundle {directory}: format {written} is newer than this version reads "
                f"({FORMAT}); upgrade tactile-core"
            )
        return Manifest.model_validate(data)
    except FileNotFoundError:
        raise CalibrationError(
            f"{directory} is no calibration bundle (it has no manifest.json); "
            f"'tactile calibrate … --out {directory}' makes one"
        ) from None
    except (ValueError, AttributeError, ValidationError, OSError) as error:
        raise CalibrationError(
            f"bundle {directory}: manifest.json is damaged; calibrate again"
        ) from error


def _save_reference(reference: Reference, path: Path) -> None:
    arrays: dict[str, Any] = {
        "pixels": reference.pixels,
        "channels": np.array(reference.channels),
        "full_scale": reference.full_scale,
        "noise": reference.noise,
        "frames": reference.frames,
    }
    if reference.marks is not None:
        arrays["marks"] = reference.marks
    np.savez(path, **arrays)


def _load_reference(path: Path) -> Reference:
    try:
        with np.load(path, allow_pickle=False) as data:
            return Reference(
                pixels=data["pixels"],
                channels=tuple(str(name) for name in data["channels"]),
                full_scale=float(data["full_scale"]),
                noise=float(data["noise"]),
                frames=int(data["frames"]),
                marks=data.get("marks"),
            )
    except (OSError, ValueError, KeyError) as error:
        raise CalibrationError(f"{path}: the reference is damaged; calibrate again") from error


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return " × ".join(str(part) for part in value)
    return str(value) or "(none)"
