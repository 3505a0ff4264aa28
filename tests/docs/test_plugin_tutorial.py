"""The tutorial for plugin authors runs as printed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.dist_info import write_dist_info

from tactile_core.plugins.registry import list_plugins, profile_directories

PAGE = Path(__file__).resolve().parents[2] / "plugins" / "README.md"
NAMED_BLOCK = re.compile(r"^`([\w./-]+)`:\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SCRIPT = re.compile(r"(?<!`:\n\n)^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


@pytest.fixture
def written(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Write the package of the page."""
    for name, text in NAMED_BLOCK.findall(page):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    write_dist_info(tmp_path, tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] == "tactile_ourlab"]:
        del sys.modules[name]


@pytest.mark.usefixtures("written")
def test_the_plugin_of_the_page_is_valid() -> None:
    info = next(info for info in list_plugins(import_components=True) if info.name == "ourlab")
    assert (info.status, info.problems) == ("ok", ())
    assert info.components == {"camera": ("colour_chart",)}


@pytest.mark.usefixtures("written")
def test_the_scripts_of_the_page_run(page: str) -> None:
    scripts = SCRIPT.findall(page)
    assert len(scripts) == 1
    for script in scripts:
        exec(compile(script, str(PAGE), "exec"), {})


@pytest.mark.usefixtures("written")
def test_the_profile_of_the_page_is_valid() -> None:
    from tactile_core.profiles.loader import load_profile

    path = profile_directories()["ourlab"] / "ourlab_bench.yaml"
    profile = load_profile(path)
    assert profile.camera.use == "ourlab.colour_chart"
    assert load_profile("ourlab_bench") == profile


def test_pytest_collects_the_tests_of_the_page_without_a_warning(written: Path) -> None:
    words = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-W", "error"]
    done = subprocess.run(
        [*words, "-p", "no:cacheprovider", "."],
        cwd=written,
        env={**os.environ, "PYTHONPATH": str(written)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "test_opening[camera ourlab.colour_chart]" in done.stdout


def test_the_links_of_the_page_are_valid(page: str) -> None:
    for link in re.findall(r"\]\((\S+?)\)", page):
        assert (PAGE.parent / link).exists(), link
