"""What is installed from wheels, outside the repository, is whole."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DISTRIBUTIONS = [ROOT, *sorted(path.parent for path in ROOT.glob("plugins/*/pyproject.toml"))]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
# With what both commands of the README install; the others need libraries of their own.
SHIPPED = [Path(path).name for path in SETTINGS["pytest"]["ini_options"]["testpaths"][1:]]

pytest.importorskip("build", reason="wheels are built with the 'dev' extra's 'build'")


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("wheels")
    for distribution in DISTRIBUTIONS:
        words = ["-m", "build", "--wheel", "--no-isolation", "--outdir", folder, distribution]
        subprocess.run([sys.executable, *words], check=True, capture_output=True)
    return sorted(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheels: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    for wheel in wheels:
        if wheel.name.split("-")[0].replace("_", "-") in ["tactile-core", *SHIPPED]:
            zipfile.ZipFile(wheel).extractall(folder)
    return folder


def tactile(installed: Path, *words: str) -> str:
    """Run the command line of the wheels, not of the repository."""
    path = f"import sys; sys.path.insert(0, {str(installed)!r})"
    code = f"{path}; import tactile_core.cli as c; print(c.__file__, file=sys.stderr); c.main()"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, *words],
        capture_output=True,
        text=True,
        check=False,
        cwd=installed,
        env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
    )
    assert done.returncode == 0, done.stderr
    assert str(installed) in done.stderr.splitlines()[0]
    return done.stdout


def test_the_shipped_network_comes_with_its_data_sheet(wheels: list[Path]) -> None:
    (networks,) = (wheel for wheel in wheels if wheel.name.startswith("tactile_networks-"))
    names = [Path(name) for name in zipfile.ZipFile(networks).namelist()]
    endings = {name.suffix for name in names if name.parent.name == "shipped"}
    assert endings == {".onnx", ".yaml", ".md"}


def test_each_wheel_is_typed_and_carries_no_tests(wheels: list[Path]) -> None:
    assert len(wheels) == len(DISTRIBUTIONS)
    for wheel in wheels:
        names = zipfile.ZipFile(wheel).namelist()
        assert any(name.endswith("/py.typed") for name in names)
        assert not [name for name in names if name.startswith("tests/") or "/tests/" in name]


def test_profiles_come_with_the_core_and_with_the_packages_of_sensors(installed: Path) -> None:
    entries = json.loads(tactile(installed, "profiles", "--json"))["profiles"]
    packaged = {path.parent for path in ROOT.glob("plugins/*/tactile_*/profiles/*.yaml")}
    folders = {installed / folder.relative_to(folder.parents[1]) for folder in packaged}
    assert {Path(entry["path"]).parent for entry in entries} == {
        installed / "sensor_profiles",
        *folders,
    }
    tactile(installed, "validate", *(entry["name"] for entry in entries))


def test_every_plugin_is_found_and_sound(installed: Path) -> None:
    said = tactile(installed, "doctor")
    for distribution in SHIPPED:
        settings = tomllib.loads((ROOT / "plugins" / distribution / "pyproject.toml").read_text())
        groups = settings["project"].get("entry-points", {})  # none that only others load
        for name in groups.get("tactile_core.v1", ()):
            assert f"plugin {name}" in said
