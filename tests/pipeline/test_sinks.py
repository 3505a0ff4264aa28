"""Readings are written to the chosen sinks, and failing sinks are reported by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from support.own_plugins import Install
from support.readings import height, reading
from support.virtual_lab import VirtualLab

from tactile_core.errors import InputError, PluginFault, ProfileError
from tactile_core.formats.npz import read_npz
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sinks import Sinks
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import HeightMap, SlipState
from tactile_core.recordings.output_folder import OutputFolder

LOG = '''
from pydantic import Field
from tactile_core import Sink
from tactile_core.interfaces.device import Options


class LogOptions(Options):
    """Options."""

    fails: str = Field(default="", description="What fails.")


class Log(Sink):
    """Records its calls."""

    Options = LogOptions
    events = []

    def _note(self, event):
        self.events.append(event)
        if event.split()[0] == self.options.fails:
            raise ValueError("no more paper")

    def open(self, session):
        super().open(session)
        self._note("open " + session.build.name)

    def write(self, reading):
        self._note("write " + reading.source)

    def close(self):
        self._note("close")
'''


@pytest.fixture
def pipeline() -> Pipeline:
    return Pipeline(load_profile("hex_fingertip"))


@pytest.fixture
def events(install: Install) -> list[str]:
    install("logs", {"log.py": LOG}, tactile_sinks={"log": "own_logs.log:Log"})
    from tactile_core.plugins.registry import resolve

    found: Any = resolve("sink", "logs.log")
    return found.events  # type: ignore[no-any-return]


def test_a_plugin_sink_is_opened_gets_each_reading_and_is_closed(
    pipeline: Pipeline, events: list[str]
) -> None:
    with Sinks(pipeline.profile, ["logs.log"]).open(pipeline) as sinks:
        for source in ("a", "b"):
            sinks.write(reading(source=source))
    assert events == ["open hex_fingertip", "write a", "write b", "close"]


def test_a_profile_names_a_sink_and_sets_its_options(events: list[str]) -> None:
    profile = load_profile(
        "hex_fingertip", overrides={"sinks": {"paper": {"use": "logs.log", "fails": "write"}}}
    )
    for name in ("paper", "logs.log"):
        with (
            pytest.raises(PluginFault, match=rf"the sink '{name}' \(logs\.log.*no more paper"),
            Sinks(profile, [name]).open(Pipeline(profile)) as sinks,
        ):
            sinks.write(reading())
        assert events[-1] == "close"


def test_wrong_options_of_a_sink_are_profile_errors(events: list[str]) -> None:
    with pytest.raises(ProfileError, match=r"sinks\.paper\.fial: .*did you mean 'fails'"):
        load_profile(
            "hex_fingertip", overrides={"sinks": {"paper": {"use": "logs.log", "fial": 1}}}
        )


@pytest.mark.parametrize("fails", ["open", "write", "close"])
def test_a_failing_sink_is_named_and_the_others_are_completed(
    tmp_path: Path, events: list[str], fails: str
) -> None:
    profile = load_profile(
        "hex_fingertip", overrides={"sinks": {"paper": {"use": "logs.log", "fails": fails}}}
    )
    pipeline = Pipeline(profile)
    with (
        pytest.raises(PluginFault, match=r"the sink 'paper' \(logs\.log.*no more paper"),
        Sinks(profile, ["npz", "paper"]).open(pipeline, OutputFolder(tmp_path)) as sinks,
    ):
        sinks.write(reading(height()))
    assert events[-1] == "close"
    if fails != "open":
        assert "height_mm" in read_npz(tmp_path / "press.v1.npz")


@pytest.mark.parametrize("name", ["jpg", "out/normals.png", "a.b.c", ".png"])
def test_an_unknown_sink_is_rejected_with_the_available_ones(pipeline: Pipeline, name: str) -> None:
    with pytest.raises(InputError, match=f"no sink '{name}'; choose from npz, tmd, png, ply"):
        Sinks(pipeline.profile, ["npz", name])


def test_files_need_a_folder(pipeline: Pipeline) -> None:
    with pytest.raises(InputError, match=r"the sink 'png' writes files; name a folder"):
        Sinks(pipeline.profile, ["png"]).open(pipeline)


def test_a_pipeline_lists_its_quantities_and_channels(lab: VirtualLab) -> None:
    calibrated = Pipeline(lab.profile, lab.bundle)
    assert HeightMap in calibrated.gives
    assert calibrated.channels == ("red", "green", "blue")


def test_a_pipeline_does_not_list_what_its_steps_cannot_measure(pipeline: Pipeline) -> None:
    assert "no bundle, so these steps are left out: height" in " ".join(pipeline.notes)
    assert HeightMap not in pipeline.gives
    assert SlipState not in pipeline.gives  # there is no reference
