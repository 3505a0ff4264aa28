"""Runs conformance test classes with pytest: repetition, skips and expected failures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FAKES = Path(__file__).parents[1] / "fakes" / "faulty"

pytest_plugins = ["pytester"]


def outcome(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, *lines: str, before: str = ""
) -> tuple[dict[str, int], str]:
    """Run a test class with these lines; return the counts and the output."""
    monkeypatch.setenv("PYTHONPATH", str(FAKES))
    body = "\n".join(f"    {line}" for line in lines)
    pytester.makepyfile(
        f"from tactile_core.testing import PluginConformance\n{before}\n\n"
        f"class TestMyLab(PluginConformance):\n{body}\n"
    )
    options = ("-p", "no:cacheprovider", "-rxs", "-k", "not import_effects and not light_import")
    result = pytester.runpytest_subprocess(*options)
    return result.parseoutcomes(), str(result.stdout)


def test_a_check_is_repeated_for_each_component_and_skipped_without_components(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts, output = outcome(pytester, monkeypatch, "plugin = 'undeclared'")
    assert counts["failed"] == 1
    assert "test_state[estimator undeclared.x]" in output
    assert "a frame's result depends on the frames before it" in output
    assert "plugin 'undeclared' registers nothing for this check" in output


@pytest.mark.parametrize("key", ["state", "state[estimator undeclared.x]"])
def test_an_expected_failure_is_reported_as_xfail(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    reason = "fix in progress"
    counts, output = outcome(
        pytester,
        monkeypatch,
        "plugin = 'undeclared'",
        f"expected_failures = {{{key!r}: {reason!r}}}",
    )
    assert (counts.get("failed"), counts["xfailed"]) == (None, 1)
    assert reason in output


def test_an_expected_failure_that_passes_is_a_failure(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts, output = outcome(
        pytester, monkeypatch, "plugin = 'in_pixels'", "expected_failures = {'state': 'old'}"
    )
    assert counts["failed"] == 2
    assert (
        "state[estimator in_pixels.x] passes, but expected_failures lists it as failing" in output
    )
    assert "remove 'state' from expected_failures" in output


@pytest.mark.parametrize("key", ["stat", "state[estimator undeclared.y]"])
def test_an_unknown_name_among_the_expected_failures_is_a_failure(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    counts, output = outcome(
        pytester, monkeypatch, "plugin = 'undeclared'", f"expected_failures = {{{key!r}: 'old'}}"
    )
    assert counts["failed"] == 2
    assert f"expected_failures names {key!r}, which is not a check of this plugin" in output


def test_without_a_simulator_the_checks_that_need_one_are_left_out_by_name(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    absent = "import tactile_core.testing.virtual_presses as v; v.SIMULATOR = 'elsewhere.virtual'"
    counts, output = outcome(pytester, monkeypatch, "plugin = 'undeclared'", before=absent)
    assert counts.get("failed") is None
    assert counts["skipped"] > 1
    assert "left out without a simulator" in output
    assert "pip install tactile-elsewhere" in output


def test_an_empty_plugin_is_a_failure(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts, output = outcome(pytester, monkeypatch, "plugin = 'nothing'")
    assert counts["failed"] == 1
    assert "registers no component, no command and no profile" in output


def test_options_and_stall_make_a_device_testable(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts, _ = outcome(
        pytester,
        monkeypatch,
        "plugin = 'demanding'",
        "options = {'demanding.x': {'port': 'loop'}}",
        "def stall(self, camera):",
        "    camera.stalled = True",
        "    return True",
    )
    assert "failed" not in counts


def test_a_missing_pytest_is_reported_in_one_sentence() -> None:
    code = (
        "import sys; sys.modules['pytest'] = None\n"
        "from tactile_core.errors import PluginError\n"
        "try:\n    import tactile_core.testing\n"
        "except PluginError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.count("\n") == 1
    assert "pip install 'tactile-core[testing]'" in done.stdout
