"""The conformance kit reports each fault in tests/fakes/faulty with the right check."""

from __future__ import annotations

import gc
import inspect
import sys
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from tactile_core.plugins.entry_points import Offer, installed_offers
from tactile_core.quantities import Quantity
from tactile_core.testing import PluginConformance
from tactile_core.testing.checks import checks_of, subjects_of
from tactile_core.testing.differences import CannotCheck, Fault
from tactile_core.testing.estimators import complete_quantities
from tactile_core.testing.virtual_presses import VirtualPress, generic_rig

FAKES = Path(__file__).parents[1] / "fakes" / "faulty"
IMPORTS = ("light_import", "import_effects")
"""Checks that start an interpreter; they run only for the plugins in ``IMPORTED``."""

REGISTERED: Mapping[str, tuple[str, str]] = {
    "nothing": ("registration", "registers no component, no command and no profile"),
    "misspelt": ("registration", "tactile_sensors, which is not a hook"),
    "listing": ("registration", "must return {name: 'module:Class'}"),
    "no_folder": ("registration", "must return an existing folder"),
    "no_class": ("components", "no attribute 'Nonexistent'"),
    "wrong_interface": ("components", "not a subclass of tactile_core.Camera"),
    "twin": ("registration", "tactile-faulty-twin"),
    "2fingers": ("registration", "not valid in front of the dot"),
    "mutable_options": ("options", "can be changed after validation"),
    "lenient_options": ("options", "accepts unknown keys"),
    "nested_options": ("options", "Lens: it accepts unknown keys"),
    "undocumented_options": ("options", "fps: no description"),
    "demanding": ("construction", "port"),
    "hasty": ("construction", "its constructor leaves the open file"),
}
IMPORTED: Mapping[str, tuple[str, str]] = {
    "imports_cv2": ("light_import", "imports cv2"),
    "heavy_command": ("light_import", "its command x imports cv2"),
    "prints": ("import_effects", "prints 'welcome to the lab"),
    "loud_command": ("import_effects", "its command x prints 'welcome to the command'"),
    "loud_format": ("import_effects", "its recording format x prints 'welcome to the format"),
    "root_logger": ("import_effects", "sets up the root logger"),
    "starts_thread": ("import_effects", "leaves a thread running"),
    "opens_socket": ("import_effects", "leaves a file or socket open"),
    "sets_environment": ("import_effects", "changes the environment"),
    "silences_warnings": ("import_effects", "changes the filters of warnings"),
}
DEVICES: Mapping[str, tuple[str, str]] = {
    "absent": ("opening", "does not open and close (DeviceError: there is no camera"),
    "opens_once": ("opening", "no longer opens again after it was closed (DeviceError: busy)"),
    "closes_once": ("guards", "it overrides close"),
    "forgets_half": ("failed_opening", "left the thread 'reader', the open file"),
    "deletes_unset": ("failed_opening", "before acquiring anything, and then"),
    "leaks_thread": ("leaks", "there is still the thread 'forgotten'"),
    "leaks_file": ("leaks", "there is still the open file"),
    "floats": ("image", "float32, neither uint8 nor uint16"),
    "four_channels": ("image", "(6, 8, 4), neither (H, W) nor (H, W, 3)"),
    "no_image": ("image", "returns ndarray instead of an Image"),
    "one_buffer": ("separate_images", "share one buffer"),
    "clock_backwards": ("timestamps", "timestamp_s decreases"),
    "uncounted": ("timestamps", "sequence goes from 0 to 0"),
    "wall_clock": ("timestamps", "is in the future"),
    "reads_closed": ("guards", "it overrides read"),
    "impatient": ("time_limit", "raises Empty"),
    "ends_early": ("time_limit", "None is the end of a recording"),
    "waits": ("time_limit", "read(timeout_s=0.001) took 0."),
    "waits_when_stalled": ("time_limit", "read(timeout_s=0.1) took 0."),
    "same_channels": ("exposures", "('white', 'white')"),
    "uncovered": ("exposures", "measure ('left',), but its channels are ('left', 'right')"),
    "too_bright": ("exposures", "levels outside 0..1: {'left': 255}"),
    "unlit": ("exposures", "no light is on"),
    "endless": ("exposures", "an exposure's exposure_time_s is 0.0"),
    "same_lights": ("lights", "its lights are named 'left', 'left'"),
    "missing_light": ("lights", "its exposures use right, missing from its lights"),
    "unsteady": ("determinism", "differ when it is read again"),
    "holding": ("determinism", "cannot pickle 'generator' object"),
    "misarmed": ("arming", "arm() returns None"),
    "disobedient": ("levels", "no light of this name"),
    "stays_lit": ("guards", "it overrides close"),
    "stays_busy": ("opening", "no longer opens again after it was closed (DeviceError: port in"),
    "unguarded": ("guards", "it overrides set"),
}
CALIBRATIONS: Mapping[str, tuple[str, str]] = {
    "unfittable": ("fit", "too few presses"),
    "unseeded": ("fit", "two fits to the same presses measure differently"),
    "doubles": ("measurement", "Gradients.x is float64 where it must be float32"),
    "gaps": ("measurement", "values that are not finite"),
    "dented": ("orientation", "∂z/∂x has the opposite sign"),
    "exchanged": ("orientation", "∂z/∂x and ∂z/∂y are swapped"),
    "degrees": ("orientation", "times the ball's; slopes are mm per mm"),
    "tilted": ("orientation", "the undeformed surface has a mean slope of 0.21"),
    "rounded": ("round_trip", "it measures differently after loading"),
    "loads_nothing": ("empty_folder", "loading an empty folder raises FileNotFoundError"),
    "any_size": ("other_size", "is measured, although the fit had 160 × 120"),
    "changes_frame": ("calibration_inputs", "values of pixels differ"),
    "unregistered_model": ("fitted_class", "returns Nameless, which no plugin registers"),
    "uncompensated": ("fitted_class", "fitted with compensation 'channel', but Uncompensated"),
    "sunken": ("orientation", "the undeformed surface has a mean height error of 5 mm"),
    "metres_deep": ("orientation", "the unit seems to be metres instead of millimetres"),
    "locked_model": ("round_trip", "cannot pickle '_thread.lock'"),
}
ESTIMATORS: Mapping[str, tuple[str, str]] = {
    "unannotated": ("annotations", "'gradients' of estimate() has no annotation"),
    "needs_unknown": ("annotations", "it needs Temperature"),
    "double_precision": ("output", "HeightMap.mm is float64 where it must be float32"),
    "half_size": ("output", "the shape (60, 80) where the image has (120, 160)"),
    "writable": ("output", "HeightMap.mm is writable"),
    "other_type": ("output", "returns Gradients but declares HeightMap"),
    "timeless": ("output", "HeightMap.timestamp_s is 0.0"),
    "in_place": ("output", "read-only"),
    "breaks": ("output", "RuntimeError: the weights do not fit"),
    "in_pixels": ("units", "the unit seems to be pixels instead of millimetres"),
    "in_metres": ("units", "the unit seems to be metres instead of millimetres"),
    "upside_down": ("units", "negative where a ball presses"),
    "not_json": ("export", "float32 is not JSON serializable"),
    "one_way": ("export", "values of Colour.rgb differ"),
    "random": ("reset", "after reset() the same frames give different results"),
    "never_forgets": ("reset", "after reset() the same frames give different results"),
    "undeclared": ("state", "depends on the frames before it"),
    "shared": ("reset", "after reset() the same frames give different results"),
    "reused_buffer": ("separate_results", "the next frame overwrites the result"),
    "changes_input": ("inputs", "values of x differ"),
    "locked": ("pickling", "when new it cannot be pickled"),
}
SINKS: Mapping[str, tuple[str, str]] = {
    "expectant": ("readings", "this reading has no HeightMap"),
    "exhausted": ("readings", "RuntimeError: closed before"),
    "unnamed_files": ("files", "it writes 000000.depth, but its endings are ()"),
    "careless": ("sink_leaks", "there is still the open file"),
}
FORMATS: Mapping[str, tuple[str, str]] = {
    "forgetful": ("copies", "the event 'reference' is written and the reference read"),
    "unclosed": ("format_leaks", "there is still the open file"),
}
SIMULATORS: Mapping[str, tuple[str, str]] = {
    "small": ("rendering", "a frame has the shape (60, 80, 3), not (120, 160, 3)"),
    "noisy": ("rendering", "the same seed and number give other frames"),
    "unreferenced": ("written_presses", "its presses cannot be read"),
    "pointed": ("written_presses", "its ball has a diameter of 0.0 mm"),
}
COMMANDS: Mapping[str, tuple[str, str]] = {
    "undocumented_command": ("command", "it has no docstring, which is its help"),
    "bare_command": ("command", "name, loud: no annotation"),
    "star_command": (
        "command",
        "has the parameter 'names', to which nothing can be passed by name",
    ),
    "async_command": ("command", "does nothing when it is called"),
    "untyped_command": ("command", "Typer currently doesn't support Union types"),
}
PROFILES: Mapping[str, tuple[str, str]] = {
    "unknown_key": ("profile", "did you mean 'thickness_mm'?"),
    "unknown_component": ("profile", "did you mean 'poisson'?"),
    "extends_nothing": ("profile", "there is no profile 'no_such_build'"),
    "absolute_path": ("profile_paths", "the absolute path '/home/lab/presses'"),
    "no_start": ("starting_bundle", "start is no calibration bundle"),
    "misnamed": ("profile_name", "it is named 'other', but its file 'misnamed.yaml'"),
    "shadowing": ("profile_name", "a profile of this name already exists (shipped)"),
    "unpicklable": ("pipeline", "of its pipeline: it cannot be pickled"),
    "failing": ("pipeline", "RuntimeError: the weights do not fit"),
}
USED = {"unpicklable": ("locked",), "failing": ("breaks",)}
"""Faulty plugins whose components a profile names."""
FAULTS = {
    **REGISTERED,
    **DEVICES,
    **CALIBRATIONS,
    **ESTIMATORS,
    **SINKS,
    **FORMATS,
    **SIMULATORS,
    **COMMANDS,
    **PROFILES,
}
ALSO = {
    "random": {"state", "pickling"},  # a random result fails every comparison
    "shared": {"state", "pickling"},  # class attributes are neither reset nor pickled
    "forgets_half": {"guards"},
    "leaks_thread": {"failed_opening"},
    "leaks_file": {"failed_opening"},
}


@pytest.fixture(autouse=True)
def faulty(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(FAKES)
    yield
    for name in [name for name in sys.modules if name.startswith("fake_faulty")]:
        del sys.modules[name]
    with warnings.catch_warnings():
        # what a fault leaks would otherwise be collected, and warned of, in a later test
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


def suite_of(name: str, **attributes: Any) -> type[PluginConformance]:
    return type("Suite", (PluginConformance,), {"plugin": name, **attributes})


def failures(suite: type[PluginConformance], *, imports: bool) -> dict[str, str]:
    """Return the message of each failed check."""
    offered = tuple(one for one in installed_offers() if is_seen(one, suite.plugin))
    with patch("tactile_core.plugins.registry.installed_offers", lambda: offered):
        return _failures(suite, imports)


def is_seen(offer: Offer, plugin: str) -> bool:
    """Whether a plugin is under test, used by it, or sound: another's faults only take time."""
    return "faulty" not in offer.distribution or offer.name in (plugin, *USED.get(plugin, ()))


def _failures(suite: type[PluginConformance], imports: bool) -> dict[str, str]:
    found = {}
    for name, method in checks_of(suite).items():
        if name == "expected_failures" or (name in IMPORTS) > imports:
            continue
        subjects = subjects_of(method, suite.registered)
        for subject in [()] if subjects is None else [(one,) for one in subjects[1]]:
            try:
                inspect.unwrap(method)(suite(), *subject)
            except Fault as fault:
                found[name] = str(fault)
            except CannotCheck:
                continue
    return found


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_fails_its_check(name: str) -> None:
    check, message = FAULTS[name]
    found = failures(suite_of(name, stall=stall), imports=False)
    assert set(found) - ALSO.get(name, set()) == {check}
    assert message in found[check]


@pytest.mark.parametrize("name", IMPORTED)
def test_a_side_effect_of_an_import_fails_its_check(name: str) -> None:
    check, message = IMPORTED[name]
    found = failures(suite_of(name), imports=True)
    assert set(found) == {check}
    assert message in found[check]


def test_a_valid_plugin_passes() -> None:
    for name in ("sound", "depths", "folders", "smooth", "greeting"):
        assert failures(suite_of(name, stall=stall), imports=True) == {}


def test_a_plugin_that_is_not_installed_fails() -> None:
    (message,) = failures(suite_of("elsewhere"), imports=True).values()
    assert "run 'pip install tactile-elsewhere'" in message


@pytest.mark.parametrize("name", ["in_metres", "floats", "absolute_path"])
def test_a_message_contains_consequence_and_remedy(name: str) -> None:
    (message,) = failures(suite_of(name), imports=False).values()
    assert name in message
    assert "\n  Why it matters: " in message
    assert "\n  What to do: " in message


def test_inputs_provides_a_quantity_that_no_estimator_computes() -> None:
    def inputs(suite: PluginConformance, scene: VirtualPress) -> dict[type[Quantity], Quantity]:
        from fake_faulty.estimators import Temperature

        return {Temperature: Temperature(300.0)}

    found = failures(suite_of("needs_unknown", inputs=inputs), imports=False)
    assert set(found) == {"output"}
    assert "NotImplementedError" in found["output"]


def test_the_inputs_of_an_estimator_are_computed_by_others_of_the_plugin() -> None:
    from fake_faulty.estimators import Temperature

    registered, rig = suite_of("not_json").registered, generic_rig()
    truth = rig.scenes[0].truth
    made = complete_quantities(truth, [Temperature], registered, rig.context, without="not_json.y")
    assert made.keys() >= truth.keys() | {Temperature}
    without = complete_quantities(
        truth, [Temperature], registered, rig.context, without="not_json.x"
    )
    assert Temperature not in without


def stall(suite: PluginConformance, camera: Any) -> bool:
    """Stall only the plugins with a fault in a stalled read."""
    camera.stalled = "stalled" in suite.plugin
    return bool(camera.stalled)
