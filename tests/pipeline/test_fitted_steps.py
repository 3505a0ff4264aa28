"""A step whose model the unit's bundle holds."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Self

import numpy as np
import pytest
from support.virtual_lab import PROFILE, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.builtin.force_linear import FEATURES, LinearForceModel
from tactile_core.bundles.bundle import Bundle, names_of
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.estimator import ForceModel
from tactile_core.pipeline.health import left_out_notes
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Quantity, Wrench


@pytest.fixture
def profile(tmp_path: Path) -> Profile:
    path = tmp_path / "force.yaml"
    path.write_text(PROFILE + "  force: {use: core.force_linear}\n")
    return load_profile(path)


@pytest.fixture
def bundle(lab: VirtualLab) -> Bundle:
    used = np.array([name == "volume" for name in FEATURES])
    weights = np.full((4, len(FEATURES)), np.nan)
    weights[2] = 3.0 * used
    model = LinearForceModel(weights, np.tile([0.05, 0.1], (4, 1)), used)
    whole = Bundle.load(lab.bundle)
    artefacts = {**whole.artefacts, "force": model}
    manifest = whole.manifest.model_copy(update={"artefacts": names_of(artefacts)})
    return replace(whole, manifest=manifest, artefacts=artefacts)


def frame_of(pipeline: Pipeline, lab: VirtualLab) -> Frame:
    return pipeline.frame(lab.image(BallPress((80.0, 60.0), 4.0, 0.7)))


def test_the_bundle_gives_the_model_to_the_step(
    profile: Profile, bundle: Bundle, lab: VirtualLab
) -> None:
    pipeline = Pipeline(profile, bundle)
    assert pipeline.notes == ()
    reading = pipeline.process(frame_of(pipeline, lab))
    wrench = reading[Wrench]
    assert wrench.fz_n > 1
    assert wrench.fz_std_n == pytest.approx(np.hypot(0.05, 0.1 * wrench.fz_n))
    assert LinearForceModel not in reading


def test_without_the_model_the_step_is_left_out(profile: Profile, lab: VirtualLab) -> None:
    pipeline = Pipeline(profile, lab.bundle)
    assert pipeline.notes == (
        "no force model in a bundle, so these steps are left out: force; fit one with 'tactile "
        "calibrate-force'",
    )
    assert Wrench not in pipeline.process(frame_of(pipeline, lab))


def test_another_process_measures_the_same_force(
    profile: Profile, bundle: Bundle, lab: VirtualLab
) -> None:
    pipeline = Pipeline(profile, bundle)
    copy: Pipeline = pickle.loads(pickle.dumps(pipeline))
    frame = frame_of(pipeline, lab)
    here, there = (one.process(frame)[Wrench] for one in (pipeline, copy))
    assert there.values.tolist() == here.values.tolist()


def test_a_tare_and_a_new_reference_keep_the_model(
    profile: Profile, bundle: Bundle, lab: VirtualLab
) -> None:
    pipeline = Pipeline(profile, bundle)
    pipeline.warm()
    frame = frame_of(pipeline, lab)
    assert not pipeline.process(frame, tare=True)[Wrench].values.any()
    again = pipeline.with_reference(bundle.reference)
    assert not again.process(frame)[Wrench].values.any()


class SpringModel(Quantity, Artefact):
    """A model that a command of its own fits."""

    noun = "spring model"
    command = "calibrate-spring"

    def save(self, directory: Path) -> None: ...

    @classmethod
    def load(cls, directory: Path) -> Self:
        return cls()


def test_each_missing_model_is_named_with_the_command_that_fits_it() -> None:
    left_out = {"spring": SpringModel, "force": ForceModel, "wrench": ForceModel}
    assert left_out_notes(left_out, bundled=True) == [
        "no spring model in a bundle, so these steps are left out: spring; fit one with 'tactile "
        "calibrate-spring'",
        "no force model in a bundle, so these steps are left out: force, wrench; fit one with "
        "'tactile calibrate-force'",
    ]
