"""The guide for LeRobot runs as printed."""

import subprocess
import sys
from pathlib import Path

import pytest
from support.dist_info import write_dist_info
from support.followed import ROOT, Reader

pytestmark = pytest.mark.pages

PLUGIN = Path(__file__).resolve().parents[1]
LEROBOT = ROOT / ".venv-lerobot-3.12/bin/python"


def test_a_finger_is_read_and_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not LEROBOT.is_file():
        pytest.skip("LeRobot 0.6 is not installed; 'make test-exports' does so")
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    text = (ROOT / "docs/how-to/in-lerobot.md").read_text(encoding="utf-8")
    assert text.count("tactile/bin/python calibrate.py") == 1
    installed, used = text.split("## Read a camera")
    reader = Reader(tmp_path, str(LEROBOT))
    (tmp_path / "page.md").write_text(installed)
    reader.follow(tmp_path / "page.md")
    subprocess.run([sys.executable, "calibrate.py"], cwd=tmp_path, check=True)
    (tmp_path / "site").mkdir()
    write_dist_info(PLUGIN, tmp_path / "site")
    reader.installed += [PLUGIN, tmp_path / "site"]
    (tmp_path / "page.md").write_text(used.replace("tactile/bin/python", sys.executable))
    reader.follow(tmp_path / "page.md")
