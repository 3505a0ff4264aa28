"""Plugins are found by metadata, imported by name, and cannot crash the host."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tactile_core.errors import PluginError
from tactile_core.interfaces.camera import Camera
from tactile_core.plugins.entry_points import installed_offers
from tactile_core.plugins.registry import (
    PluginInfo,
    list_plugins,
    profile_directories,
    resolve,
)

FAKES = Path(__file__).parents[1] / "fakes"

Site = Callable[[str], None]


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> Iterator[Site]:
    """Add a committed folder of fake distributions to the path for one test."""

    def forget() -> None:
        for name in [name for name in sys.modules if name.startswith("fake_")]:
            del sys.modules[name]

    forget()
    yield lambda folder: monkeypatch.syspath_prepend(FAKES / folder)
    forget()


@pytest.fixture
def fakes(site: Site) -> None:
    """Valid and broken plugins together."""
    site("site_packages")


@pytest.fixture
def listed(fakes: None) -> dict[tuple[str, str], PluginInfo]:
    return {(info.name, info.distribution): info for info in list_plugins()}


def refusal(kind: str, name: str) -> str:
    with pytest.raises(PluginError) as caught:
        resolve(kind, name)  # type: ignore[call-overload]
    message = str(caught.value)
    assert "\n" not in message
    return message


def imported_fakes() -> set[str]:
    return {name for name in sys.modules if name.startswith("fake_")}


@pytest.mark.usefixtures("fakes")
def test_a_component_is_found_by_its_name() -> None:
    cls = resolve("camera", "mylab.still")
    assert issubclass(cls, Camera)
    with cls(cls.Options()) as camera:
        image = camera.read()
    assert image is not None
    assert image.pixels.shape == (6, 8)


@pytest.mark.usefixtures("fakes")
def test_resolving_a_component_imports_only_its_plugin_and_module() -> None:
    resolve("estimator", "mylab.peak")
    assert imported_fakes() == {"fake_mylab", "fake_mylab.peak"}


@pytest.mark.usefixtures("fakes")
def test_listing_installed_plugins_imports_none() -> None:
    names = {offer.name for offer in installed_offers()}
    assert {"mylab", "broken", "twin", "futuristic"} <= names
    assert imported_fakes() == set()


def test_a_distribution_added_to_the_path_is_found_immediately(site: Site) -> None:
    assert "mylab" not in {offer.name for offer in installed_offers()}
    site("site_packages")
    assert "mylab" in {offer.name for offer in installed_offers()}


@pytest.mark.usefixtures("fakes")
def test_the_same_distribution_twice_on_the_path_is_not_a_conflict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "Tactile_MyLab-1.5.dist-info"
    copy.mkdir()
    (copy / "METADATA").write_text("Metadata-Version: 2.1\nName: Tactile.MyLab\nVersion: 1.5\n")
    (copy / "entry_points.txt").write_text("[tactile_core.v1]\nmylab = fake_mylab\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert [o.version for o in installed_offers() if o.name == "mylab"] == ["1.5"]
    assert resolve("camera", "mylab.still").__name__ == "StillCamera"


@pytest.mark.usefixtures("fakes")
def test_a_missing_plugin_is_reported_with_its_pip_command() -> None:
    message = refusal("illumination", "unheard_rig.three_colour")
    assert "illumination 'unheard_rig.three_colour'" in message
    assert "pip install tactile-unheard-rig" in message


@pytest.mark.usefixtures("fakes")
def test_a_misspelt_plugin_gets_a_suggestion() -> None:
    assert "did you mean 'mylab'?" in refusal("camera", "my_lab.still")
    assert imported_fakes() == set()


@pytest.mark.usefixtures("fakes")
def test_a_misspelt_component_gets_a_suggestion() -> None:
    message = refusal("estimator", "mylab.peek")
    assert "did you mean 'peak'?" in message
    assert "tactile-mylab 1.4" in message


@pytest.mark.usefixtures("fakes")
def test_an_unknown_component_gets_the_list_of_available_ones() -> None:
    assert "it has peak, peak_again" in refusal("estimator", "mylab.xyz")
    assert "it has none" in refusal("calibrator", "mylab.xyz")


@pytest.mark.usefixtures("fakes")
def test_a_component_of_another_kind_is_reported_with_its_kind() -> None:
    message = refusal("camera", "mylab.peak")
    assert "mylab.peak" in message
    assert "is of the kind estimator" in message


@pytest.mark.parametrize("name", ["replay", "", "core.", "."])
def test_a_name_without_plugin_and_component_is_rejected(name: str) -> None:
    assert "camera" in refusal("camera", name)


@pytest.mark.usefixtures("fakes")
@pytest.mark.parametrize(
    ("name", "origin", "cause", "cause_type"),
    [
        ("broken.x", "tactile-broken 0.3", "a_library_that_is_not_installed", ModuleNotFoundError),
        ("quitter.x", "tactile-quitter 2.0", "no licence found", SystemExit),
        ("absent.x", "tactile-absent 0.1", "nothing_of_this_name", AttributeError),
        ("failing.x", "tactile-failing 0.1", "a drive that is away", OSError),
    ],
)
def test_a_plugin_that_raises_is_named_with_distribution_version_and_cause(
    name: str, origin: str, cause: str, cause_type: type[BaseException]
) -> None:
    with pytest.raises(PluginError) as caught:
        resolve("camera", name)
    message = str(caught.value)
    assert repr(name.partition(".")[0]) in message
    assert origin in message
    assert cause in message
    assert isinstance(caught.value.__cause__, cause_type)


def test_a_keyboard_interrupt_is_not_suppressed(site: Site) -> None:
    site("interrupted")
    with pytest.raises(KeyboardInterrupt):
        resolve("camera", "interrupted.x")
    with pytest.raises(KeyboardInterrupt):
        list_plugins()


@pytest.mark.usefixtures("fakes")
@pytest.mark.parametrize(
    ("kind", "name", "fault"),
    [
        ("estimator", "camera_instead", "not a subclass of tactile_core.Estimator"),
        ("estimator", "function_instead", "not a subclass of tactile_core.Estimator"),
        ("estimator", "no_class", "Missing"),
        ("estimator", "no_colon", "not a subclass of tactile_core.Estimator"),
        ("estimator", "no_module", "fake_clumsy.nowhere"),
        ("estimator", "quits", "no licence found"),
        ("camera", "unfinished", "does not define _close, _read"),
    ],
)
def test_an_invalid_component_is_rejected_with_its_fault(kind: str, name: str, fault: str) -> None:
    message = refusal(kind, f"clumsy.{name}")
    assert f"{kind} clumsy.{name}" in message
    assert "tactile-clumsy 0.5" in message
    assert fault in message


@pytest.mark.usefixtures("fakes")
@pytest.mark.parametrize(
    ("plugin", "fault"),
    [
        ("typo", "did you mean 'tactile_estimators'?"),
        ("greedy", "config"),
        ("listing", "must return {name: 'module:Class'}"),
        ("unmarked", "decorate tactile_cameras with @hookimpl"),
    ],
)
def test_a_plugin_that_breaks_the_hook_contract_is_rejected(plugin: str, fault: str) -> None:
    message = refusal("camera", f"{plugin}.still")
    assert f"tactile-{plugin} 0.1" in message
    assert fault in message


@pytest.mark.usefixtures("fakes")
def test_two_distributions_with_the_same_plugin_name_are_both_reported() -> None:
    message = refusal("camera", "twin.x")
    assert "tactile-twin-a 1.0" in message
    assert "tactile-twin-b 2.1" in message


@pytest.mark.usefixtures("fakes")
@pytest.mark.parametrize(
    ("plugin", "group", "upgrade"),
    [
        ("ancient", "tactile_core.v0", "tactile-ancient"),
        ("futuristic", "tactile_core.v2", "tactile-core"),
    ],
)
def test_a_plugin_for_another_api_is_reported_without_importing_it(
    plugin: str, group: str, upgrade: str
) -> None:
    message = refusal("camera", f"{plugin}.x")
    assert group in message
    assert f"pip install --upgrade {upgrade}" in message
    assert imported_fakes() == set()


def test_a_distribution_with_unreadable_entry_points_is_reported(site: Site) -> None:
    site("garbled")
    assert "tactile-garbled 0.1" in refusal("camera", "garbled.x")
    (info,) = (one for one in list_plugins() if one.distribution == "tactile-garbled")
    assert info.status == "broken"
    assert "entry_points.txt" in info.problems[0]


def test_listing_reports_the_problem_of_every_broken_plugin(
    listed: dict[tuple[str, str], PluginInfo],
) -> None:
    broken = {
        "absent", "broken", "clumsy", "empty", "failing", "greedy", "listing", "quitter", "typo",
        "unmarked",
    }  # fmt: skip
    found = {info.name: info for info in listed.values() if info.name in broken}
    assert set(found) == broken
    for info in found.values():
        assert info.status == "broken"
        assert all(info.distribution in problem for problem in info.problems)
        assert info.problems


def test_listing_shows_the_components_of_a_valid_plugin(
    listed: dict[tuple[str, str], PluginInfo],
) -> None:
    info = listed["mylab", "tactile-mylab"]
    assert (info.status, info.version, info.problems) == ("ok", "1.4", ())
    assert info.components == {
        "camera": ("still",),
        "illumination": ("ring",),
        "light_driver": ("box",),
        "estimator": ("peak", "peak_again"),
    }


def test_listing_reports_both_plugins_with_the_same_name(
    listed: dict[tuple[str, str], PluginInfo],
) -> None:
    for distribution in ("tactile-twin-a", "tactile-twin-b"):
        info = listed["twin", distribution]
        assert info.status == "broken"
        assert "tactile-twin-a 1.0 and tactile-twin-b 2.1" in info.problems[0]


def test_listing_reports_another_api_without_importing_it(
    listed: dict[tuple[str, str], PluginInfo],
) -> None:
    info = listed["futuristic", "tactile-futuristic"]
    assert (info.status, info.group) == ("other API", "tactile_core.v2")
    assert "fake_raises_if_imported" not in sys.modules


def test_distributions_without_plugins_are_not_listed(
    listed: dict[tuple[str, str], PluginInfo],
) -> None:
    assert not [info for info in listed.values() if info.distribution == "bystander"]


@pytest.mark.usefixtures("fakes")
def test_listing_can_import_every_component() -> None:
    shallow, deep = (
        {info.name: info for info in list_plugins(import_components=deep)}["clumsy"]
        for deep in (False, True)
    )
    assert len(shallow.problems) == 1
    assert len(deep.problems) == 8
    assert shallow.components == deep.components


@pytest.mark.usefixtures("fakes")
def test_profile_folders_are_those_of_valid_plugins() -> None:
    folders = profile_directories()
    assert folders["mylab"] == FAKES / "site_packages" / "fake_mylab" / "profiles"
    assert "clumsy" not in folders


@pytest.mark.usefixtures("fakes")
def test_no_other_distribution_can_replace_the_core() -> None:
    core, other = (info for info in list_plugins() if info.name == "core")
    assert (core.distribution, core.status) == ("tactile-core", "ok")
    assert (other.distribution, other.status) == ("tactile-usurper", "broken")
    assert "tactile-usurper 6.6" in other.problems[0]
    assert "tactile-core" in refusal("camera", "core.replai")


def test_the_core_is_found_without_metadata(monkeypatch: pytest.MonkeyPatch) -> None:
    package = Path(sys.modules["tactile_core"].__file__ or "").parents[1]
    library = [entry for entry in sys.path if "site-packages" not in entry]
    monkeypatch.setattr(sys, "path", [str(package), *library])
    assert installed_offers() == ()
    assert [(info.name, info.status) for info in list_plugins()] == [("core", "ok")]
    assert "did you mean 'replay'?" in refusal("camera", "core.reply")


def test_the_core_registers_replay_through_the_public_hooks() -> None:
    core = list_plugins()[0]
    assert (core.name, core.distribution, core.status) == ("core", "tactile-core", "ok")
    assert "replay" in core.components["camera"]


def test_importing_the_registry_imports_no_heavy_modules() -> None:
    unwanted = ("importlib.metadata", "numpy", "pydantic", "cv2", "tactile_core.builtin")
    code = (
        f"import sys, tactile_core.plugins.registry; "
        f"print(*[m for m in {unwanted!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
