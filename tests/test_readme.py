"""What the README shows works as it stands there."""

import re
import shutil
from pathlib import Path

import pytest
from virtual_lab import VirtualLab

from tactile_core.profiles.loader import load_profile

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()


def block(language: str) -> str:
    """The first block of code in a language."""
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found.group(1)


def test_the_profile_is_valid(tmp_path: Path) -> None:
    path = tmp_path / "my_sensor.yaml"
    path.write_text(block("yaml"))
    assert load_profile(path).name == "my_sensor"


def test_a_revision_takes_one_line(tmp_path: Path) -> None:
    (tmp_path / "my_sensor.yaml").write_text(block("yaml"))
    path = tmp_path / "second.yaml"
    path.write_text('extends: my_sensor.yaml\nrevision: "2"\n')
    assert load_profile(path).revision == "2"


def test_the_first_script_prints_a_line_per_image(
    lab: VirtualLab,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copy(lab.profile_path, tmp_path / "my_sensor.yaml")
    shutil.copytree(lab.bundle, tmp_path / "bundle")
    shutil.copytree(lab.presses, tmp_path / "recording")
    monkeypatch.chdir(tmp_path)
    exec(block("python"), {})
    assert len(capsys.readouterr().out.splitlines()) == 10


def test_every_page_and_picture_that_is_linked_exists() -> None:
    links = re.findall(r"\]\(([^)#:]+)\)", README)
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
