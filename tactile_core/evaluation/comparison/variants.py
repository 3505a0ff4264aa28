"""The variants that are compared: the profile as it is, and one change each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from tactile_core.errors import InputError, PluginError, ProfileError, TactileError
from tactile_core.pipeline.sensor import Sensor, open_sensor
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile

CALIBRATION = "calibration"


@dataclass(frozen=True)
class ComparedInput:
    """What every variant measures.

    Attributes
    ----------
    input : Path
    reference : Path, "first" or None
    serial : str or None
    """

    input: Path
    reference: Path | str | None = None
    serial: str | None = None


@dataclass(frozen=True)
class Variant:
    """One way to measure a recording.

    Attributes
    ----------
    name : str
        ``as it is``, or the swap.
    profile : Profile
    bundle : Path or None
        None takes the unit's own, if there is one.
    """

    name: str
    profile: Profile
    bundle: Path | None = None

    def open(self, recording: ComparedInput) -> Sensor:
        """Open the recording as a sensor that measures in this way.

        Raises
        ------
        TactileError
            As :func:`~tactile_core.pipeline.sensor.open_sensor`, with the variant's name before it.
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
    """Return the profile as it is, and one variant for each swap.

    Parameters
    ----------
    profile : str or Path
        A profile's name or the path of its YAML file.
    swaps : iterable of (step, use)
        A step of the profile's chain and the estimator to use in it, with the options that both
        know and defaults for the others; or ``("calibration", path of a bundle)``.
    bundle : Path, optional
        The calibration of all variants but those that swap it.

    Raises
    ------
    InputError
        There is no such step.
    ProfileError, PluginError
        There is no such estimator, or it cannot take the step.
    """
    asked = list(dict.fromkeys(swaps))
    plain = load_profile(profile)
    variants = [Variant("as it is", plain, bundle)]
    for step, use in asked:
        name = f"{step}={use}"
        if step == CALIBRATION:
            variants.append(Variant(name, plain, _bundle_folder(use)))
            continue
        _check_step(step, plain)
        resolve("estimator", use)
        try:
            swapped = load_profile(profile, overrides={"estimators": {step: {"use": use}}})
        except ProfileError as error:
            raise ProfileError(f"{name}: {error}", error.problems) from error
        variants.append(Variant(name, swapped, bundle))
    return variants


def parse_swap(words: str) -> tuple[str, str]:
    """Return step and use of ``STEP=USE``.

    Raises
    ------
    InputError
        It is not of this form.
    """
    step, equals, use = words.partition("=")
    if not (step and equals and use):
        raise InputError(
            f"--swap {words}: write STEP=USE, for example height=core.robust_poisson or "
            f"calibration=path/of/a/bundle"
        )
    return step, use


def _check_step(step: str, profile: Profile) -> None:
    known = [*profile.estimators, CALIBRATION]
    if step in known:
        return
    near = get_close_matches(step, known, 1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise InputError(f"{profile.name} has no step {step!r}; {hint}There are {', '.join(known)}")


def _bundle_folder(use: str) -> Path:
    folder = Path(use)
    if not folder.is_dir():
        try:
            resolve("calibrator", use)
        except PluginError:
            raise InputError(
                f"calibration={use}: there is no such folder; name a bundle's folder, which "
                f"'tactile calibrate' writes"
            ) from None
        raise InputError(
            f"calibration={use}: {use} is a model, which has to be fitted first; run 'tactile "
            f"calibrate … --model {use} --out FOLDER' and swap in calibration=FOLDER"
        )
    return folder
