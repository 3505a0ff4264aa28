"""A bundle holds artefacts by name, also those of plugins."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.bundles_on_disk import held
from support.dist_info import write_dist_info
from support.virtual_lab import VirtualLab

from tactile_core.bundles.bundle import Bundle, names_of
from tactile_core.errors import CalibrationError, PluginError, PluginFault
from tactile_core.interfaces.artefact import Artefact
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.registry import registered_name, resolve
from tactile_core.quantities import HeightMap

PROJECT = """\
[project]
name = "tactile-forcelab"
version = "0.1.0"

[project.entry-points."tactile_core.v1"]
forcelab = "tactile_forcelab"
"""
HOOKS = """\
from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_artefacts():
    return {"spring": "tactile_forcelab.spring:Spring"}
"""
SPRING = """\
from tactile_core import Artefact, CalibrationError


class Spring(Artefact):
    def __init__(self, n_per_mm):
        self.n_per_mm = n_per_mm

    def save(self, directory):
        (directory / "spring.txt").write_text(repr(self.n_per_mm))

    @classmethod
    def load(cls, directory):
        try:
            return cls(float((directory / "spring.txt").read_text()))
        except (OSError, ValueError) as error:
            raise CalibrationError(f"{directory} holds no spring") from error


class Nameless(Spring):
    pass
"""


@pytest.fixture
def spring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The artefact class of an installed third-party package."""
    site = tmp_path / "site"
    (site / "tactile_forcelab").mkdir(parents=True)
    for name, text in (
        ("pyproject.toml", PROJECT),
        ("tactile_forcelab/__init__.py", HOOKS),
        ("tactile_forcelab/spring.py", SPRING),
    ):
        (site / name).write_text(text)
    write_dist_info(site, site)
    monkeypatch.syspath_prepend(site)
    yield resolve("artefact", "forcelab.spring")
    for name in [name for name in sys.modules if name.partition(".")[0] == "tactile_forcelab"]:
        del sys.modules[name]


def with_force(bundle: Bundle, force: Artefact) -> Bundle:
    artefacts = {**bundle.artefacts, "force": force}
    manifest = bundle.manifest.model_copy(update={"artefacts": names_of(artefacts)})
    return replace(bundle, manifest=manifest, artefacts=artefacts)


def test_two_artefacts_come_back_each_from_its_own_folder(
    lab: VirtualLab, spring: Any, tmp_path: Path
) -> None:
    with_force(Bundle.load(lab.bundle), spring(2.5)).save(tmp_path / "b")
    assert set(held(tmp_path / "b")) == {
        "manifest.json",
        "reference.npz",
        "errors/errors.npz",
        "light/model.npz",
        "force/spring.txt",
    }
    again = Bundle.load(tmp_path / "b")
    assert again.manifest.artefacts == {
        "light": "core.mlp",
        "errors": "core.slope_errors",
        "force": "forcelab.spring",
    }
    force = again.artefact("force")
    assert isinstance(force, spring)
    assert force.n_per_mm == 2.5
    assert again.calibration is again.artefact("light")


def test_an_artefact_of_a_missing_plugin_names_the_package_to_install(
    lab: VirtualLab, spring: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_force(Bundle.load(lab.bundle), spring(2.5)).save(tmp_path / "b")
    monkeypatch.undo()
    with pytest.raises(PluginError, match="pip install tactile-forcelab"):
        Bundle.load(tmp_path / "b")


def test_an_artefact_that_the_bundle_lacks_is_refused_in_one_sentence(lab: VirtualLab) -> None:
    with pytest.raises(CalibrationError, match="'force', only light, errors; calibrate"):
        Bundle.load(lab.bundle).artefact("force")


def test_a_changed_artefact_is_detected(lab: VirtualLab, spring: Any, tmp_path: Path) -> None:
    with_force(Bundle.load(lab.bundle), spring(2.5)).save(tmp_path / "b")
    (tmp_path / "b" / "force" / "spring.txt").write_text("9.9")
    with pytest.raises(CalibrationError, match=r"force/spring\.txt is not the file"):
        Bundle.load(tmp_path / "b")


def test_a_light_model_that_measures_nothing_is_not_written(
    lab: VirtualLab, spring: Any, tmp_path: Path
) -> None:
    bundle = Bundle.load(lab.bundle)
    manifest = bundle.manifest.model_copy(update={"artefacts": {"light": "forcelab.spring"}})
    with pytest.raises(PluginFault, match="loaded Spring, no Calibration"):
        replace(bundle, manifest=manifest, artefacts={"light": spring(2.5)}).save(tmp_path / "b")
    assert not (tmp_path / "b").exists()


def test_a_class_is_stored_by_its_registered_name(spring: Any) -> None:
    assert registered_name("artefact", spring) == "forcelab.spring"
    nameless = sys.modules[spring.__module__].Nameless
    assert registered_name("artefact", nameless) is None
    with pytest.raises(PluginFault, match="registered by no hook tactile_artefacts"):
        names_of({"force": nameless(1.0)})


def test_a_bundle_can_hold_a_force_model_alone(
    lab: VirtualLab, spring: Any, tmp_path: Path
) -> None:
    whole = Bundle.load(lab.bundle)
    manifest = whole.manifest.model_copy(update={"artefacts": {"force": "forcelab.spring"}})
    replace(whole, manifest=manifest, artefacts={"force": spring(2.5)}).save(tmp_path / "b")
    again = Bundle.load(tmp_path / "b")
    assert again.calibration is None
    assert again.manifest.model == ""
    pipeline = Pipeline(lab.profile, again)
    assert pipeline.notes == (
        "no bundle, so these steps are left out: height, contact; make one with 'tactile "
        "calibrate' and give it with --bundle",
    )
    assert HeightMap not in pipeline.process(pipeline.frame(lab.image(None)))


@pytest.mark.parametrize("names", [{}, {"light": "core.mlp", "../x": "a.b"}])
def test_a_manifest_names_a_model_and_plain_folders(lab: VirtualLab, names: dict[str, str]) -> None:
    manifest = Bundle.load(lab.bundle).manifest
    with pytest.raises(ValueError, match="artefacts"):
        type(manifest).model_validate(manifest.model_dump() | {"artefacts": names})
