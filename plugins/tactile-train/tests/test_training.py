"""Training: runs a few steps and exports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.interfaces.estimator import SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Reference
from tactile_networks.steps import ForceNetwork
from tactile_sim.simulation import write_frame
from tactile_sim.stage import VirtualStage
from tactile_train.network_training import (
    FIRST_UNIT,
    FIRST_UNSEEN,
    Plan,
    train_on_recording,
    train_on_virtual_units,
)


def test_a_network_is_trained_exported_and_run(tmp_path: Path) -> None:
    design = load_profile("hex_fingertip", sim=True)
    plan = Plan(tmp_path, epochs=2, command="tactile train-force")
    trained = train_on_virtual_units(design, plan, units=1, samples=4)
    assert trained.network.stat().st_size > 1000
    assert "unseen objects" in trained.sheet.read_text()
    assert trained.summary()["scores"]

    stage = VirtualStage(design)
    frame = stage.frame()
    step = ForceNetwork(
        ForceNetwork.Options(manifest=trained.manifest), SensorContext(design.image, design.gel)
    )
    reference = Reference(frame.pixels.astype(np.float32), frame.channels)
    found = step.estimate(frame, reference, None, None)
    assert np.isfinite(found.values).all()
    assert found.std is not None


def test_a_recording_with_forces_is_trained_on(tmp_path: Path) -> None:
    small = {"image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104}}
    stage = VirtualStage("hex_fingertip", overrides=small)
    write_frame(tmp_path / "reference", stage.frame(), "undeformed")
    stage.indenter("sphere", diameter_mm=18)
    lines = ["frame,fx_n,fy_n,fz_n,tz_nmm,sequence"]
    for number in range(6):
        stage.press(force_n=1.0 + number, steps=1)
        write_frame(tmp_path / "frames", stage.frame(), f"{number}")
        lines.append(f"{number},{','.join(map(str, stage.wrench))},{'abc'[number % 3]}")
    (tmp_path / "forces.csv").write_text("\n".join(lines))
    done = train_on_recording(
        load_profile("hex_fingertip", overrides=small),
        Plan(tmp_path / "network", epochs=2),
        input=tmp_path / "frames",
        forces=tmp_path / "forces.csv",
        reference=tmp_path / "reference",
    )
    assert "6 labelled frames" not in done.sheet.read_text()
    assert "2 labelled frames of frames, in 1 sequences" in done.sheet.read_text()
    ((heading, scores),) = done.scores
    assert heading == "Scores: held-out sequences"
    assert scores[0].samples == 2


def test_a_network_by_torch_and_by_opencv_is_the_same(tmp_path: Path) -> None:
    import torch

    from tactile_networks.manifest import load_network
    from tactile_train.export import onnx_bytes
    from tactile_train.training import LoadMap

    view = np.array([17.664, 13.248])
    made = LoadMap(6, (160, 120), view, np.ones(4, np.float32)).eval()
    planes = np.random.default_rng(0).normal(size=(1, 6, 120, 160)).astype(np.float32)
    with torch.no_grad():
        expected = made(torch.from_numpy(planes)).numpy()[0]
    network = load_network(onnx_bytes(made, 6, (160, 120)), "force.onnx", "opencv")
    assert network.run(planes) == pytest.approx(expected, rel=1e-3, abs=1e-3)
    assert FIRST_UNSEEN > FIRST_UNIT
