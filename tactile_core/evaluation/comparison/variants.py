"""Variants to compare: the unchanged profile, and one variant per swap."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError, PluginError, ProfileError, TactileError
from tactile_core.formats.text import mapping_of
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.sensor import Sensor
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

CALIBRATION = "calibration"


@dataclass(frozen=True)
class ComparedInput:
    """The recording that every variant measures.

    Attributes
    ----------
    input : Path
    reference : Path, "first" or None
        Recording of the undeformed sensor; None for that of the bundle.
    serial : str or None
        Serial number of the unit.
    """

    input: Path
    reference: Path | str | None = None
    serial: str | None = None


@dataclass(frozen=True)
class Variant:
    """A profile and a bundle to measure a recording with.

    Attributes
    ----------
    name : str
        ``as it is`` for the unchanged profile, or the swap.
    profile : Profile
    bundle : Path or None
        Calibration; None for the unit's own, if any.
    """

    name: str
    profile: Profile
    bundle: Path | None = None

    def open(self, recording: ComparedInput) -> Sensor:
        """Open the recording as a sensor of this variant.

        Raises
        ------
        TactileError
            As :func:`~tactile_core.pipeline.opening.open_sensor`, prefixed by the variant's name.
        """
        try:
            return open_sensor(
                self.profile,
                serial=recording.serial,
                bundle=self.bundle,
                input=recording.input,
                reference=recording.reference,
            )
        except TactileError as error:
            raise type(error)(f"{self.name}: {error}") from error


def variants_of(
    profile: str | Path, swaps: Iterable[tuple[str, str]], bundle: Path | None = None
) -> list[Variant]:
    """Return the unchanged profile, and one variant per swap.

    Parameters
    ----------
    profile : str or Path
        A profile's name or the path of its YAML file.
    swaps : iterable of (step, use)
        A step of the profile's chain and the estimator to use in it, by name or with options as a
        profile writes it: ``{use: core.force_cnn, manifest: my.yaml}``. Options that both
        estimators have are kept; the others take their defaults. Or ``("calibration", path of a
        bundle)``.
    bundle : Path, optional
        Calibration of all variants that do not swap it.

    Raises
    ------
    InputError
        The profile has no such step.
    ProfileError, PluginError
        The estimator does not exist, or does not fit the step.
    """
    unique_swaps = list(dict.fromkeys(swaps))
    plain = load_profile(profile)
    variants = [Variant("as it is", plain, bundle)]
    for step, use in unique_swaps:
        name = f"{step}={use}"
        if step == CALIBRATION:
            variants.append(Variant(name, plain, _bundle_folder(use)))
            continue
        _check_step(step, plain)
        component = _component(step, use)
        resolve("estimator", component["use"])
        try:
            swapped = load_profile(profile, overrides={"estimators": {step: component}})
        except ProfileError as error:
            raise ProfileError(f"{name}: {error}", error.problems) from error
        variants.append(Variant(name, swapped, bundle))
    return variants


def parse_swap(words: str) -> tuple[str, str]:
    """Return step and use of ``STEP=USE``.

    Raises
    ------
    InputError
        The text does not have this form.
    """
    step, equals, use = words.partition("=")
    if not (step and equals and use):
        raise InputError(
            f"--swap {words}: write STEP=USE, for example height=core.robust_poisson or "
            f"calibration=path/of/a/bundle"
        )
    return step, use


def _component(step: str, use: str) -> dict[str, Any]:
    """Return the section of a profile that names an estimator."""
    if not use.startswith("{"):
        return {"use": use}
    section = mapping_of(use, Path(f"--swap {step}"))
    if not isinstance(section.get("use"), str):
        raise InputError(f"--swap {step}={use}: name the estimator, {{use: plugin.name, …}}")
    return section


def _check_step(step: str, profile: Profile) -> None:
    steps = [*profile.estimators, CALIBRATION]
    if step in steps:
        return
    near = get_close_matches(step, steps, 1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise InputError(f"{profile.name} has no step {step!r}; {hint}There are {', '.join(steps)}")


def _bundle_folder(use: str) -> Path:
    folder = Path(use)
    if not folder.is_dir():
        try:
            resolve("calibrator", use)
        except PluginError:
            raise InputError(
                f"calibration={use}: there is no such folder; give the folder of a bundle from "
                f"'tactile calibrate'"
            ) from None
        raise InputError(
            f"calibration={use}: {use} is a model that has to be fitted first; run 'tactile "
            f"calibrate … --model {use} --out FOLDER' and swap in calibration=FOLDER"
        )
    return folder
