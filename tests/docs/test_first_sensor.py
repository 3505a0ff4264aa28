"""The guide to the first sensor runs as printed, from an empty folder."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.pages

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tutorials" / "first-sensor.md"
TEXT = PAGE.read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def type_in(line: str) -> None:
    """Run one line of the page as a shell would."""
    program, *words = shlex.split(line)
    assert program == "tactile"
    done = subprocess.run(
        [sys.executable, "-m", "tactile_core.cli", *words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_the_commands_and_scripts_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall(TEXT)
    assert [language for language, _ in blocks] == ["python", "sh", "sh", "sh", "sh", "python"]
    for language, block in blocks:
        if language == "python":
            exec(compile(block, str(PAGE), "exec"), {})
        else:
            for line in block.replace("\\\n", " ").splitlines():
                type_in(line)
    profile = (tmp_path / "my_sensor.yaml").read_text(encoding="utf-8")
    assert "mm_per_px: 0.125\n" in profile
    assert (tmp_path / "bundle" / "report.html").exists()


def test_the_links_of_the_page_are_valid() -> None:
    for link in re.findall(r"\]\(([^)\s#]+)(?:#\S*?)?\)", TEXT):
        assert (PAGE.parent / link).exists(), link
