"""A calibration that another program made becomes a bundle that says so."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.command_line import refused, tactile
from support.own_plugins import Install
from support.virtual_lab import VirtualLab

from tactile_core import open_sensor
from tactile_core.bundles.bundle import Bundle
from tactile_core.quantities import Gradients

MATRIX = """\
import numpy as np

from tactile_core import Calibration, CalibrationError, Gradients, InputError
from tactile_core.interfaces.importer import Importer


class Matrix(Calibration):
    def __init__(self, weights):
        self.weights = weights

    def measure(self, frame, reference):
        if frame.pixels.shape[2] != len(self.weights):
            raise CalibrationError(f"the matrix is of {len(self.weights)} channels; use its sensor")
        slopes = ((frame.pixels / reference.pixels - 1) @ self.weights).astype(np.float32)
        gx, gy = np.ascontiguousarray(np.moveaxis(slopes, 2, 0))
        return Gradients(gx, gy, ~frame.saturated.any(axis=2), frame.mm_per_px)

    def save(self, directory):
        np.save(directory / "weights.npy", self.weights)

    @classmethod
    def load(cls, directory):
        return cls(np.load(directory / "weights.npy"))


class Unregistered(Matrix):
    pass


class Forgetful(Matrix):
    def save(self, directory):
        pass

    @classmethod
    def load(cls, directory):
        if not directory.exists():
            raise CalibrationError("its weights are missing; calibrate again")
        return super().load(directory)


class Hasty(Matrix):
    def save(self, directory):
        (directory / "weights.txt").write_text("0")


class MatrixImporter(Importer):
    def read(self, path, build):
        try:
            return Matrix(np.loadtxt(path, delimiter=",", ndmin=2))
        except ValueError:
            raise InputError(f"{path} is no table of numbers; export the matrix as CSV") from None


class Nothing(Importer):
    def read(self, path, build):
        return None


class Careless(Importer):
    def read(self, path, build):
        return {}["weights"]


class ForgetfulImporter(Importer):
    def read(self, path, build):
        return Forgetful(np.zeros((3, 2)))


class HastyImporter(Importer):
    def read(self, path, build):
        return Hasty(np.zeros((3, 2)))


class Stranger(Importer):
    def read(self, path, build):
        return Unregistered(np.zeros((3, 2)))
"""
KINDS = {
    "matrix": "MatrixImporter",
    "nothing": "Nothing",
    "careless": "Careless",
    "forgetful": "ForgetfulImporter",
    "hasty": "HastyImporter",
    "stranger": "Stranger",
}


@pytest.fixture
def plugin(install: Install) -> None:
    install(
        "lab",
        {"matrix.py": MATRIX},
        tactile_importers={kind: f"own_lab.matrix:{name}" for kind, name in KINDS.items()},
        tactile_artefacts={
            name.lower(): f"own_lab.matrix:{name}" for name in ("Matrix", "Forgetful", "Hasty")
        },
    )


@pytest.fixture
def run(plugin: None, lab: VirtualLab, tmp_path: Path) -> Callable[..., tuple[object, ...]]:
    """Return the words of the command for a table of three channels."""
    table = tmp_path / "matrix.csv"
    table.write_text("0,-0.5\n0.4,0.25\n-0.4,0.25\n")

    def words(*more: object, file: Path = table, kind: str = "lab.matrix") -> tuple[object, ...]:
        out = tmp_path / "bundle"
        return "import", file, "--as", kind, "--profile", lab.profile_path, "--out", out, *more

    return words


Words = Callable[..., tuple[object, ...]]


def test_the_manifest_says_where_the_model_comes_from_and_claims_no_score(
    run: Words, lab: VirtualLab, tmp_path: Path
) -> None:
    done = tactile(*run("--reference", lab.reference, "--serial", "7", "--gel", "b"))
    assert (done.returncode, done.stderr) == (0, "")
    assert "lab.matrix, imported from" in done.stdout
    manifest = json.loads((tmp_path / "bundle" / "manifest.json").read_text())
    assert manifest["imported"] == {"kind": "lab.matrix", "file": "matrix.csv"}
    assert manifest["artefacts"] == {"light": "lab.matrix"}
    assert (manifest["held_out"], manifest["presses_used"]) == (None, 0)
    assert (manifest["serial"], manifest["gel_id"]) == ("7", "b")


def test_an_imported_calibration_measures_like_any_other(
    run: Words, lab: VirtualLab, tmp_path: Path
) -> None:
    assert tactile(*run("--reference", lab.reference)).returncode == 0
    bundle = Bundle.load(tmp_path / "bundle")
    assert bundle.reference is not None
    with open_sensor(lab.profile, bundle=bundle, input=lab.presses) as sensor:
        reading = sensor.read()
    change = reading.frame.pixels / bundle.reference.pixels - 1
    expected = change @ np.loadtxt(tmp_path / "matrix.csv", delimiter=",")
    np.testing.assert_allclose(reading[Gradients].x, expected[..., 0], atol=0.02)


def test_without_a_reference_each_use_needs_one(
    run: Words, lab: VirtualLab, tmp_path: Path
) -> None:
    done = tactile(*run("--json"))
    assert "the bundle holds no reference" in done.stderr
    out = tmp_path / "bundle"
    assert json.loads(done.stdout) == {
        "bundle": str(out),
        "model": "lab.matrix",
        "imported": {"kind": "lab.matrix", "file": "matrix.csv"},
        "held_out": None,
    }
    assert not (out / "reference.npz").exists()
    words = (
        "run",
        lab.profile_path,
        "--bundle",
        out,
        "--input",
        lab.presses,
        "--frames",
        1,
        "--json",
    )
    without = tactile(*words)
    assert "no reference, so these steps are left out: height, contact" in without.stderr
    assert json.loads(without.stdout)["max_height_mm"] is None
    given = tactile(*words, "--reference", lab.reference)
    assert json.loads(given.stdout)["max_height_mm"] > 0


def test_a_sensor_keeps_its_reference_when_an_imported_bundle_has_none(
    run: Words, lab: VirtualLab, tmp_path: Path
) -> None:
    assert tactile(*run()).returncode == 0
    with open_sensor(lab.profile, bundle=lab.bundle, input=lab.presses) as sensor:
        before = sensor.read()[Gradients].x
        sensor.use_bundle(Bundle.load(tmp_path / "bundle"))
        after = sensor.read()[Gradients].x
    assert before.shape == after.shape


def test_an_unknown_kind_is_one_sentence_with_the_known_ones(run: Words) -> None:
    said = refused(*run(kind="lab.other"))
    assert said.count("\n") == 1
    assert "no importer 'other'" in said
    assert "(installed importers: " in said
    assert f"{', '.join(f'lab.{kind}' for kind in sorted(KINDS))}" in said
    assert "pip install" in refused(*run(kind="elsewhere.matrix"))
    said = refused(*run(kind="matrix"))
    assert "write plugin.name" in said
    assert "core.matrix" not in said  # the core has no importer


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("not a table", "is no table of numbers; export the matrix as CSV"),
        ("1,2\n3,4\n", "the matrix is of 2 channels; use its sensor"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_before_a_bundle_is_written(
    run: Words, tmp_path: Path, text: str, said: str
) -> None:
    file = tmp_path / "other.csv"
    file.write_text(text)
    message = refused(*run(file=file))
    assert said in message
    assert message.count("\n") == 1
    assert not (tmp_path / "bundle").exists()


def test_a_missing_file_is_named(run: Words, tmp_path: Path) -> None:
    for kind in ("lab.matrix", "elsewhere.matrix"):
        assert "absent.csv" in refused(*run(file=tmp_path / "absent.csv", kind=kind))


def test_a_bundle_never_replaces_the_file_that_it_is_made_of(run: Words, tmp_path: Path) -> None:
    said = refused(*run("--out", tmp_path))
    assert "contains FILE" in said
    assert (tmp_path / "matrix.csv").exists()


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("lab.nothing", "returned NoneType, not a Calibration"),
        ("lab.careless", "failed: KeyError: 'weights'"),
        ("lab.stranger", "is registered by no hook tactile_artefacts"),
        ("lab.forgetful", "cannot load what it has saved (CalibrationError: its weights are"),
        ("lab.hasty", "failed: FileNotFoundError"),
    ],
)
def test_a_fault_of_an_importer_names_its_plugin_and_writes_nothing(
    run: Words, tmp_path: Path, kind: str, said: str
) -> None:
    done = tactile(*run(kind=kind))
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert said in done.stderr
    assert "tactile-lab 1.0" in done.stderr
    assert not (tmp_path / "bundle").exists()
