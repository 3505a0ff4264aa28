"""The bundle: a folder with the artefacts, the reference and the manifest of one physical unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from typing import Any

from tactile_core.bundles.manifest import (
    ERRORS,
    LIGHT,
    Manifest,
    bundle_files,
    check_files,
    read_manifest,
    write_manifest,
)
from tactile_core.bundles.places import check_place
from tactile_core.errors import CalibrationError, InputError, PluginFault, TactileError, words_of
from tactile_core.formats.npz import read_npz, reference_arrays, reference_of, write_npz
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.calibration import Calibration, SlopeErrors
from tactile_core.plugins.blame import blame, fault
from tactile_core.plugins.entry_points import library_versions
from tactile_core.plugins.registry import registered_name, resolve
from tactile_core.profiles.loader import profile_hash
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference

# Classes of the artefacts that the core uses itself.
_KINDS: Mapping[str, Any] = {LIGHT: Calibration, ERRORS: SlopeErrors}

_REFERENCE = "reference.npz"


@dataclass(frozen=True, eq=False)
class Bundle:
    """The fitted models of one physical unit, with its reference and manifest.

    Attributes
    ----------
    manifest : Manifest
    artefacts : mapping of str to Artefact
        Fitted models by the names in the manifest; ``"light"`` is a :class:`Calibration`. A bundle
        without it holds models of steps, such as one of force.
    reference : Reference or None
        The undeformed sensor; None if the light model was imported without one.
    """

    manifest: Manifest
    artefacts: Mapping[str, Artefact]
    reference: Reference | None

    @property
    def calibration(self) -> Calibration | None:
        """The light model; None if only other models are fitted."""
        model = self.artefacts.get(LIGHT)
        assert isinstance(model, Calibration | None)
        return model

    @property
    def errors(self) -> SlopeErrors | None:
        """The size of the errors of its slopes; None if it is unknown."""
        found = self.artefacts.get(ERRORS)
        assert isinstance(found, SlopeErrors | None)
        return found

    def artefact(self, name: str) -> Artefact:
        """Return an artefact by its name.

        Raises
        ------
        CalibrationError
            The bundle does not hold it.
        """
        if name not in self.artefacts:
            raise CalibrationError(
                f"the bundle of {self.manifest.profile} holds no artefact {name!r}, only "
                f"{', '.join(self.artefacts)}; calibrate it for this unit"
            )
        return self.artefacts[name]

    def save(self, directory: Path, report: Callable[[Path], None] | None = None) -> None:
        """Write the bundle, atomically replacing an older one.

        The bundle is written into a temporary folder next to its destination, which then takes its
        place in one step. Readers see either the old or the new bundle at any moment. With several
        writers, the last one wins.

        Parameters
        ----------
        directory : Path
        report : callable, optional
            Writes additional files (``report.html`` and its pictures) into the folder it is given.

        Raises
        ------
        InputError
            The folder holds anything but a bundle.
        PluginFault
            An artefact cannot be saved, or not be loaded again; the previous contents remain.
        OSError
            Writing fails; the previous contents remain.
        """
        # only where something is written
        from tactile_core.formats.folders import fresh_folder, replace_folder

        directory = check_place(directory)
        with fresh_folder(directory) as fresh:
            for name, artefact in self.artefacts.items():
                _save_artefact(artefact, name, fresh / name)
            if self.reference is not None:
                write_npz(fresh / _REFERENCE, reference_arrays(self.reference))
            if report is not None:
                report(fresh)
            write_manifest(fresh, self.manifest)
            replace_folder(fresh, directory, bundle_files)

    @classmethod
    def load(cls, directory: Path) -> Bundle:
        """Read a bundle and check its integrity.

        A bundle that is replaced while it is read is read again.

        Raises
        ------
        CalibrationError
            The folder is not a bundle, is damaged, or has the format of another version.
        """
        directory = Path(directory)
        end_s = monotonic() + 30.0  # [s] a bundle that is replaced meanwhile is read again
        while monotonic() < end_s:
            before = _identity(directory)
            try:
                bundle = cls._load_folder(directory)
            except Exception:
                if _identity(directory) == before:
                    raise
            else:
                if _identity(directory) == before:
                    return bundle
        raise CalibrationError(f"bundle {directory} keeps being replaced; try again")

    @classmethod
    def _load_folder(cls, directory: Path) -> Bundle:
        manifest = read_manifest(directory)
        check_files(directory, manifest)
        artefacts = {
            name: _loaded_artefact(directory, name, use) for name, use in manifest.artefacts.items()
        }
        held = _REFERENCE in manifest.files
        reference = _load_reference(directory / _REFERENCE, manifest) if held else None
        return cls(manifest, artefacts, reference)

    def check(self, profile: Profile, serial: str | None = None) -> list[str]:
        """Check that the bundle belongs to a profile and unit; return warnings.

        A bundle belongs to a serial and to the optical part of the profile: image, light and gel.
        If that part is the same, the profile may have another name, camera or estimators. If it has
        changed, the name distinguishes an edited profile from another sensor's. A starting
        calibration is of no unit: only the images have to be of its size.

        Raises
        ------
        CalibrationError
            Serial, image size, bit depth or scale differ, or it is another sensor's.
        """
        mine, image = self.manifest, profile.image
        optics_differ = not mine.starting and mine.profile_hash != profile_hash(profile)
        own_serial = serial is None or mine.starting
        for what, ours, theirs in (
            ("sensor", mine.profile, profile.name if optics_differ else mine.profile),
            ("serial", mine.serial, mine.serial if own_serial else serial),
            ("image size", mine.image_size_px, (image.width_px, image.height_px)),
            ("bit depth", mine.bit_depth, image.bit_depth),
        ):
            if ours != theirs:
                raise CalibrationError(
                    f"the bundle was made for {what} {_plain(ours)}, not {_plain(theirs)}; "
                    f"use the bundle of this sensor or run 'tactile calibrate'"
                )
        if mine.starting:  # slopes depend on no scale
            return [
                f"this unit is not calibrated: its heights are coarse, by a starting calibration "
                f"of {mine.starting.of}, and relative to the first image where no --reference is "
                f"given; 'tactile calibrate {profile.name} --live --ball-diameter-mm D' measures "
                f"it, with ten presses of a ball"
            ]
        # [share] measured scales differ by as much
        if abs(image.mm_per_px / mine.mm_per_px - 1) > 0.01:
            raise CalibrationError(
                f"the bundle was made at {mine.mm_per_px:g} mm per pixel and this input has "
                f"{image.mm_per_px:g}; calibrate at the scale of the input"
            )
        notes = [f"'tactile calibrate' said of this bundle: {doubt}" for doubt in mine.doubts]
        if optics_differ:
            notes.append(
                "the profile's image, light or gel has changed since this bundle was made; "
                "calibrate again if readings look wrong"
            )
        return notes

    def check_gel(self, gel: str) -> None:
        """Check that the bundle was made with a gel; a starting calibration is of every gel.

        Raises
        ------
        CalibrationError
            It was made with another one, or the gel was not named.
        """
        if self.manifest.gel_id != gel and not self.manifest.starting:
            made = f"gel {self.manifest.gel_id}" if self.manifest.gel_id else "a gel without a name"
            raise CalibrationError(
                f"the bundle was made with {made}, not with gel {gel}; use the bundle of this gel "
                f"or run 'tactile calibrate --gel {gel}'"
            )


def names_of(artefacts: Mapping[str, Artefact]) -> dict[str, str]:
    """Return the registered name of each artefact's class, for a manifest.

    Raises
    ------
    PluginFault
        A class is not registered, so that its bundle could not be loaded.
    """
    names = {}
    for name, artefact in artefacts.items():
        use = registered_name("artefact", type(artefact))
        if use is None:
            raise fault(
                _words(name), artefact, "is registered by no hook tactile_artefacts, which names it"
            )
        names[name] = use
    return names


def manifest_for(
    profile: Profile, channels: tuple[str, ...], artefacts: Mapping[str, Artefact], **known: Any
) -> Manifest:
    """Return the manifest of artefacts that are made now for the image and light of a profile.

    Parameters
    ----------
    profile : Profile
    channels : tuple of str
    artefacts : mapping of str to Artefact
    **known
        Further fields of the manifest.
    """
    return Manifest(
        profile=profile.name,
        revision=profile.revision,
        artefacts=names_of(artefacts),
        image_size_px=(profile.image.width_px, profile.image.height_px),
        crop=profile.image.crop,
        channels=channels,
        mm_per_px=profile.image.mm_per_px,
        bit_depth=profile.image.bit_depth,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        versions=library_versions(),
        profile_hash=profile_hash(profile),
        **known,
    )


def _save_artefact(artefact: Artefact, name: str, folder: Path) -> None:
    folder.mkdir()
    with blame(_words(name), artefact):
        artefact.save(folder)
    if not any(folder.iterdir()):
        folder.rmdir()  # a manifest lists files, not folders
    try:
        _load_artefact(type(artefact), name, folder)
    except PluginFault:
        raise
    except TactileError as error:
        what = f"cannot load what it has saved ({words_of(error)})"
        raise fault(_words(name), artefact, what) from error


def _load_artefact(cls: type[Artefact], name: str, folder: Path) -> Artefact:
    with blame(_words(name), cls):
        artefact = cls.load(folder)
    wanted = _KINDS.get(name, Artefact)
    if not isinstance(artefact, wanted):
        found = type(artefact).__name__
        raise fault(_words(name), cls, f"loaded {found}, no {wanted.__name__}")
    loaded: Artefact = artefact
    return loaded


def _loaded_artefact(directory: Path, name: str, use: str) -> Artefact:
    cls = resolve("artefact", use)
    try:
        return _load_artefact(cls, name, directory / name)
    except PluginFault:
        raise
    except TactileError as error:
        raise type(error)(f"bundle {directory}: {use}: {error}") from error
    except Exception as error:
        raise CalibrationError(
            f"bundle {directory}: {use} cannot load its model ({type(error).__name__}: {error}); "
            f"calibrate again"
        ) from error


def _words(name: str) -> str:
    """Return the name of an artefact for messages."""
    return "the calibration" if name == LIGHT else f"the artefact {name!r}"


def _identity(directory: Path) -> tuple[int, int, int] | None:
    """Return an identity of a folder that changes when another folder takes its place."""
    try:
        found = directory.stat()
    except OSError:
        return None
    # file systems reuse the inodes of deleted folders; the time is that of the last renaming
    return found.st_dev, found.st_ino, found.st_ctime_ns


def _load_reference(path: Path, manifest: Manifest) -> Reference:
    try:
        reference = reference_of(read_npz(path))
        height, width, _ = reference.pixels.shape
        if (reference.channels, (width, height)) != (manifest.channels, manifest.image_size_px):
            raise ValueError("its arrays do not fit the manifest")
    except (InputError, ValueError, LookupError, TypeError, OverflowError) as error:
        raise CalibrationError(f"{path}: the reference is damaged; calibrate again") from error
    return reference


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return " × ".join(str(part) for part in value)
    return str(value) or "(none)"
