"""Trains a network for ``networks.force_cnn`` on virtual units or on a recording, and scores it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.interfaces.calibration import Progress, Silent
from tactile_core.profiles.model import Profile
from tactile_train.samples import (
    UnitSamples,
    kept_samples,
    mirrored_channels,
    recorded_samples,
    sample_size,
)
from tactile_train.scores import (
    ForceScore,
    covered_share,
    fitted_std,
    force_scores,
)
from tactile_train.virtual_forces import (
    CELL_PX,
    LARGEST_N,
    TRAINING_OBJECTS,
    TRAVEL_MM,
    TWIST_DEG,
    UNSEEN_OBJECTS,
)

LICENCE = "MIT"  # Of networks that train on the project's own virtual sensors
# Numbers of the first virtual units: trained on, for the standard deviations, and scored.
FIRST_UNIT, FIRST_CHECKED, FIRST_UNSEEN = 101, 9101, 9001


class Trained(NamedTuple):
    """A trained network on disk.

    Attributes
    ----------
    network, manifest, sheet : Path
    scores : sequence of (heading, scores)
    """

    network: Path
    manifest: Path
    sheet: Path
    scores: Sequence[tuple[str, Sequence[ForceScore]]]

    def summary(self) -> Mapping[str, Any]:
        """Return JSON-ready values."""
        return {
            "network": str(self.network),
            "manifest": str(self.manifest),
            "sheet": str(self.sheet),
            "scores": {
                heading: [one.summary() for one in scores] for heading, scores in self.scores
            },
        }


class Plan(NamedTuple):
    """How to train.

    Attributes
    ----------
    out : Path
        Folder of the results.
    epochs : int
        Passes over the samples.
    seed : int
        Of the network and the order of the samples.
    command : str
        For the data sheet.
    """

    out: Path
    epochs: int = 12
    seed: int = 0
    command: str = ""


def train_on_virtual_units(
    design: Profile,
    plan: Plan,
    *,
    units: int,
    samples: int = 250,
    progress: Progress | None = None,
) -> Trained:
    """Train on virtual units of a design, and score on other units with objects never seen.

    Rendered samples stay in ``out/data``, so that a later run with more units continues.

    Parameters
    ----------
    design : Profile
        Loaded with ``sim=True``.
    plan : Plan
    units : int
        Number of units to train on.
    samples : int
        Of each unit.
    progress : Progress, optional
    """
    progress = progress or Silent()
    checked = max(1, min(4, units // 16))
    wanted = [
        *((FIRST_UNIT + k, TRAINING_OBJECTS) for k in range(units)),
        *((FIRST_CHECKED + k, TRAINING_OBJECTS) for k in range(checked)),
        *((FIRST_UNSEEN + k, UNSEEN_OBJECTS) for k in range(checked)),
    ]
    progress.stage("rendering", 0.6)
    rendered: list[UnitSamples] = []
    for unit, objects in wanted:
        # [units] One in so many is rendered at full size; half the size takes half the time
        half = unit < FIRST_UNSEEN and unit % 8 != 0
        path = plan.out / "data" / f"unit_{unit:04d}.npz"
        rendered.append(kept_samples(path, design, unit, objects=objects, count=samples, half=half))
        progress.fraction(len(rendered) / len(wanted))
    known, check, unseen = (
        rendered[:units],
        rendered[units : units + checked],
        rendered[units + checked :],
    )
    names = ", ".join(one.name for one in TRAINING_OBJECTS)
    data = (
        f"{sum(len(one.images) for one in known)} images of {units} virtual units of "
        f"`{design.name}` (numbers {FIRST_UNIT} to {FIRST_UNIT + units - 1}), which differ in "
        f"lights, coating, gel, markers and camera. Objects, with diameters in mm: {names}; "
        f"cylinders are 12 mm long. Forces up to {LARGEST_N:g} N, shear up to "
        f"{TRAVEL_MM:g} mm with partial and full slip, twist up to "
        f"{TWIST_DEG:g}°, at random places; a part of the contacts is truncated by the "
        f"image border. The labels are the simulator's forces."
    )
    of = f"unseen objects on {checked} unseen units ({FIRST_UNSEEN} …), full-size frames"
    limits = (
        "Trained and scored on a virtual sensor. Real images differ from virtual ones; score it on "
        "recordings with forces before you use it with a real sensor. The network estimates force "
        "over the gel's shear modulus, so an error of the modulus in the profile is one of the "
        "force."
    )
    return _finish(design, plan, (known, check, unseen), (data, f"Scores: {of}", limits), progress)


def train_on_recording(
    profile: Profile,
    plan: Plan,
    *,
    input: Path,
    forces: Path,
    reference: Path | str | None = None,
    progress: Progress | None = None,
) -> Trained:
    """Train on a recording with forces, and score on sequences that were held out.

    One sequence in five, and at least one, is held out for the score, and as many for the standard
    deviations.

    Parameters
    ----------
    profile : Profile
    plan : Plan
    input : Path
        The recording.
    forces : Path
        CSV with the columns ``frame`` or ``file``, ``fx_n``, ``fy_n``, ``fz_n``, ``tz_nmm`` and
        perhaps ``sequence``.
    reference : Path or "first", optional
        The undeformed sensor.
    progress : Progress, optional
    """
    progress = progress or Silent()
    progress.stage("reading", 0.2)
    sequences = recorded_samples(profile, input, forces, reference, progress)
    names = sorted(sequences)
    order = np.random.default_rng(plan.seed).permutation(len(names))
    held = max(1, len(names) // 5)
    unseen_names, check_names = (
        sorted(names[k] for k in order[first : first + held]) for first in (0, held)
    )
    unseen = [sequences[name] for name in unseen_names]
    check = [sequences[name] for name in check_names]
    others = {*unseen_names, *check_names}
    known = [one for name, one in sequences.items() if name not in others]
    count = sum(len(one.images) for one in known)
    data = (
        f"{count} labelled frames of {input.name}, in {len(known)} sequences; held out: "
        f"{', '.join(unseen_names)}; for the standard deviations: {', '.join(check_names)}."
    )
    limits = "Trained on one recording: the scores cover no other sensor, gel or object."
    return _finish(
        profile,
        plan,
        (known, check, unseen),
        (data, "Scores: held-out sequences", limits),
        progress,
    )


def _finish(
    profile: Profile,
    plan: Plan,
    parts: tuple[list[UnitSamples], list[UnitSamples], list[UnitSamples]],
    words: tuple[str, str, str],
    progress: Progress,
) -> Trained:
    import torch

    from tactile_train.export import (
        DataSheet,
        onnx_bytes,
        write_network,
    )
    from tactile_train.training import (
        LoadMap,
        TrainingSet,
        predict_wrenches,
        train,
    )

    known, check, unseen = parts
    data, heading, limits = words
    size = sample_size(profile)
    samples = TrainingSet(known, (size[0] // CELL_PX, size[1] // CELL_PX))
    channels = known[0].images.shape[3]
    view_mm = np.array([profile.image.width_px, profile.image.height_px], np.float64)
    view_mm *= profile.image.mm_per_px
    torch.manual_seed(plan.seed)
    made = LoadMap(2 * channels, size, view_mm, samples.load_std)
    progress.stage("training", 0.4)
    mirrored = _find_mirrored(profile, channels)
    network = train(
        samples, made, epochs=plan.epochs, seed=plan.seed, mirrored=mirrored, progress=progress
    )

    def scored(units: Sequence[UnitSamples], modulus_mpa: float | None) -> list[ForceScore]:
        found = [
            predict_wrenches(network, one) * (modulus_mpa or one.shear_modulus_mpa) for one in units
        ]
        return force_scores(
            np.concatenate(found),
            np.concatenate([one.wrenches for one in units]),
            np.concatenate([one.labels for one in units]).tolist(),
            np.concatenate([one.outside for one in units]),
        )

    scores = [(heading, scored(unseen, None))]
    design_mpa = profile.gel.shear_modulus_mpa
    if len({one.shear_modulus_mpa for one in unseen} | {design_mpa}) > 1:
        other = "The same with the design's shear modulus instead of the unit's own"
        scores.append((other, scored(unseen, design_mpa)[:1]))

    def relative(units: Sequence[UnitSamples]) -> tuple[Float64, Float64]:
        true = np.concatenate([one.relative for one in units]).astype(np.float64)
        return np.concatenate([predict_wrenches(network, one) for one in units]), true

    std = fitted_std(*relative(check))
    shares = ", ".join(f"{100 * share:.0f}" for share in covered_share(*relative(unseen), std))
    content = onnx_bytes(network, 2 * channels, size)
    count = sum(weight.numel() for weight in network.parameters())
    sheet = DataSheet(
        title=f"Force from images of {profile.name}",
        data=data,
        command=plan.command,
        network=f"A map of loads on cells that is summed, {count} weights, {plan.epochs} epochs, "
        f"seed {plan.seed}. Input: the "
        f"difference to the reference and the reference, {size[0]} × {size[1]} px. "
        f"Of the errors in all scored samples, {shares} % (Fx, Fy, Fz, Tz) are below one standard "
        f"deviation.",
        licence=LICENCE,
        scores=scores,
        limits=limits,
    )
    paths = write_network(plan.out, "force", content, profile, size, std, sheet)
    return Trained(*paths, scores)


def _find_mirrored(profile: Profile, channels: int) -> tuple[int, ...] | None:
    lights = profile.illumination.options.get("lights") or ()
    azimuths = [float(light["azimuth_deg"]) for light in lights if "azimuth_deg" in light]
    return mirrored_channels(azimuths) if len(azimuths) == channels else None
