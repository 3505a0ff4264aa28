"""A profile with names of an earlier version is refused with what to write instead."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.command_line import refused

from tactile_core.errors import PluginError, ProfileError
from tactile_core.plugins.earlier_names import COMPONENTS, KEYS, MOVED
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.profiles.loader import load_profile

OLD = Path(__file__).parents[1] / "data" / "small_lab.yaml"


def problems_of(path: Path, text: str) -> list[str]:
    path.write_text(f"schema: 1\nname: lab\nextends: hex_fingertip\n{text}")
    with pytest.raises(ProfileError) as refusal:
        load_profile(path)
    return [str(problem).removeprefix(f"{path}:") for problem in refusal.value.problems]


def test_the_virtual_camera_of_an_old_profile_has_another_name() -> None:
    assert "is 'sim.virtual' now" in refused("validate", OLD)
    said = refused("run", OLD, "--sim")
    assert said.startswith(
        f"tactile: {OLD}:16:12: camera.use: camera 'core.virtual' is 'sim.virtual' now, which 'pip "
    )
    assert said.endswith("; write the new name\n")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "estimators:\n  tracks: {use: core.tracking}\n",
            "5:12: estimators.tracks.use: estimator 'core.tracking' is of an earlier version; "
            "write 'core.marker_tracking'",
        ),
        (
            "estimators:\n  release: {use: core.shear_release}\n",
            "5:13: estimators.release.use: estimator 'core.shear_release' is of an earlier "
            "version; remove the step, which 'core.slip' does not need any more",
        ),
        (
            "sinks:\n  file: {use: core.hdf5}\n",
            "5:10: sinks.file.use: sink 'core.hdf5' is of an earlier version; save 'record', "
            "which 'tactile convert' turns into HDF5",
        ),
        (
            "optics: {lamps: {}, marks: {}}\n",
            "4:10: optics.lamps: is a key of an earlier version; write 'lights'",
        ),
        (
            "estimators:\n  slip: {use: core.slip, window_mm: 3, tolerance: 1}\n",
            "5:26: estimators.slip.window_mm: is a key of an earlier version; write it at the "
            "step 'core.contact_shear'",
        ),
    ],
)
def test_an_earlier_name_is_refused_with_what_to_write(
    tmp_path: Path, text: str, said: str
) -> None:
    found = problems_of(tmp_path / "lab.yaml", text)
    assert said in found
    assert all("of an earlier version" in problem for problem in found)


@pytest.mark.parametrize("name", COMPONENTS)
def test_no_component_has_an_earlier_name(name: str) -> None:
    plugin, _, component = name.partition(".")
    infos = [info for info in list_plugins() if info.name == plugin]
    assert not any(component in names for info in infos for names in info.components.values())
    with pytest.raises(PluginError, match="is of an earlier version"):
        resolve("camera", name)


@pytest.mark.parametrize("name", MOVED)
def test_a_component_that_has_moved_is_named_by_its_new_name(name: str) -> None:
    with pytest.raises(PluginError, match=rf"is '{MOVED[name]}' now"):
        resolve("camera", name)


@pytest.mark.parametrize(("component", "key"), [owner for owner in KEYS if "core." in owner[0]])
def test_no_option_has_an_earlier_name(component: str, key: str) -> None:
    assert key not in resolve("estimator", component).Options.model_fields
