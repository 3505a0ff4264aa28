"""Each fault of tests/fakes/faulty is caught by its check, in a sentence that names it."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from tactile_core.quantities import Quantity
from tactile_core.testing import PluginConformance
from tactile_core.testing.checks import checks_of, subjects_of
from tactile_core.testing.faults import Fault, Unjudged
from tactile_core.testing.needed_quantities import completed
from tactile_core.testing.virtual_presses import VirtualPress, generic_rig

FAKES = Path(__file__).parents[1] / "fakes" / "faulty"
IMPORTS = ("light_import", "import_effects")
"""Checks that start an interpreter; tried on the plugins that are about them."""

REGISTERED: Mapping[str, tuple[str, str]] = {
    "nothing": ("registration", "registers no component and no profile"),
    "misspelt": ("registration", "tactile_sensors, which is no hook"),
    "listing": ("registration", "must return {name: 'module:Class'}"),
    "no_folder": ("registration", "must return an existing folder"),
    "no_class": ("components", "no attribute 'Nonexistent'"),
    "wrong_interface": ("components", "not a subclass of tactile_core.Camera"),
    "twin": ("collision", "offered by tactile-faulty 0.1 and by tactile-faulty-twin 0.2"),
    "2fingers": ("names", "cannot be written before the dot"),
    "mutable_options": ("options", "can be changed after validation"),
    "lenient_options": ("options", "accepts a key that it does not know"),
    "nested_options": ("options", "Lens: it accepts a key that it does not know"),
    "undocumented_options": ("options", "fps: no description"),
    "demanding": ("construction", "port"),
    "hasty": ("construction", "its constructor leaves the open file"),
}
IMPORTED: Mapping[str, tuple[str, str]] = {
    "imports_cv2": ("light_import", "imports cv2"),
    "prints": ("import_effects", "prints 'welcome to the lab"),
    "root_logger": ("import_effects", "sets up the root logger"),
    "starts_thread": ("import_effects", "leaves a thread running"),
    "opens_socket": ("import_effects", "leaves a file or socket open"),
    "sets_environment": ("import_effects", "changes the environment"),
    "silences_warnings": ("import_effects", "changes the filters of warnings"),
    "writes_file": ("import_effects", "writes a file"),
    "runs_program": ("import_effects", "runs a program"),
}
DEVICES: Mapping[str, tuple[str, str]] = {
    "absent": ("opening", "does not open and close (DeviceError: there is no camera"),
    "opens_once": ("opening", "no longer opens again after it was closed (DeviceError: busy)"),
    "closes_once": ("closing_twice", "closing it twice, or before it was opened, fails"),
    "forgets_half": ("failed_opening", "left the thread 'reader', the open file"),
    "deletes_unset": ("failed_opening", "before anything was acquired, and then"),
    "leaks_thread": ("leaks", "there is still the thread 'forgotten'"),
    "leaks_file": ("leaks", "there is still the open file"),
    "floats": ("image", "float32, neither uint8 nor uint16"),
    "four_channels": ("image", "(6, 8, 4), neither (H, W) nor (H, W, 3)"),
    "no_image": ("image", "returns ndarray instead of an Image"),
    "one_buffer": ("own_pixels", "share one buffer"),
    "clock_backwards": ("clock", "timestamp_s goes back"),
    "uncounted": ("clock", "sequence goes from 0 to 0"),
    "reads_closed": ("reading_closed", "reading before it is opened gives something"),
    "impatient": ("time_limit", "raises Empty"),
    "ends_early": ("time_limit", "None is the end of a recording"),
    "waits": ("time_limit", "read(timeout_s=0.001) took 0."),
    "waits_when_stalled": ("time_limit", "read(timeout_s=0.1) took 0."),
    "same_channels": ("channels", "('white', 'white')"),
    "uncovered": ("exposures", "measure ('left',), and its channels are ('left', 'right')"),
    "too_bright": ("exposures", "levels outside 0..1: {'left': 255}"),
    "unlit": ("exposures", "no light shines"),
    "endless": ("exposures", "an exposure's exposure_time_s is 0.0"),
    "same_lights": ("lights", "its lights are named 'left', 'left'"),
    "missing_light": ("lights", "right shine, and are none of its lights"),
    "unsteady": ("order", "differ when it is asked again"),
    "holding": ("illumination_pickling", "cannot pickle 'generator' object"),
    "misarmed": ("arming", "arm() returns None"),
    "disobedient": ("levels", "no light of this name"),
    "stays_lit": ("darkness", "it closes without darkness"),
    "stays_busy": ("opening", "no longer opens again after it was closed (DeviceError: port in"),
    "unguarded": ("levels", "accepted instead of raising DeviceError, though it is closed"),
}
CALIBRATIONS: Mapping[str, tuple[str, str]] = {
    "unfittable": ("fit", "too few presses"),
    "unseeded": ("fit", "two fits on the same presses measure differently"),
    "doubles": ("measurement", "Gradients.x is float64 where it must be float32"),
    "gaps": ("measurement", "values that are not finite"),
    "dented": ("sense", "∂z/∂x has the opposite sign"),
    "exchanged": ("sense", "∂z/∂x and ∂z/∂y are exchanged"),
    "degrees": ("sense", "times the ball's; slopes are mm per mm"),
    "tilted": ("sense", "untouched skin has a mean slope of 0.21"),
    "rounded": ("round_trip", "saved and loaded, it measures otherwise"),
    "loads_nothing": ("empty_folder", "loading an empty folder raises FileNotFoundError"),
    "any_size": ("other_size", "is measured, though it was fitted on 160 × 120"),
    "changes_frame": ("calibration_inputs", "values of pixels differ"),
    "unregistered_model": ("fitted_class", "returns Nameless, which no plugin registers"),
    "uncompensated": ("fitted_class", "fitted with compensation 'channel', and Uncompensated"),
    "sunken": ("sense", "untouched skin is measured 5 mm off its place"),
    "metres_deep": ("sense", "it looks like metres in place of millimetres"),
    "locked_model": ("calibration_pickling", "cannot pickle '_thread.lock'"),
}
ESTIMATORS: Mapping[str, tuple[str, str]] = {
    "unannotated": ("annotations", "'gradients' of estimate() has no annotation"),
    "needs_unknown": ("annotations", "it needs Temperature"),
    "double_precision": ("output", "HeightMap.mm is float64 where it must be float32"),
    "half_size": ("output", "the shape (60, 80) where the image has (120, 160)"),
    "writable": ("output", "HeightMap.mm is writable"),
    "other_type": ("output", "returns Gradients and declares HeightMap"),
    "timeless": ("output", "HeightMap.timestamp_s is 0.0"),
    "in_place": ("output", "read-only"),
    "breaks": ("output", "RuntimeError: the weights do not fit"),
    "in_pixels": ("units", "it looks like pixels in place of millimetres"),
    "in_metres": ("units", "it looks like metres in place of millimetres"),
    "upside_down": ("units", "negative where a ball presses"),
    "not_json": ("export", "float32 is not JSON serializable"),
    "one_way": ("export", "values of Colour.rgb differ"),
    "random": ("reset", "after reset() the same frames give something else"),
    "never_forgets": ("reset", "after reset() the same frames give something else"),
    "undeclared": ("state", "depends on the frames before it"),
    "shared": ("instances", "change when another one is at work"),
    "reused_buffer": ("own_result", "the next frame overwrites the result"),
    "changes_input": ("inputs", "values of x differ"),
    "locked": ("pickling", "when new it does not pickle"),
}
SINKS: Mapping[str, tuple[str, str]] = {
    "expectant": ("readings", "this reading has no HeightMap"),
    "exhausted": ("readings", "RuntimeError: closed before"),
    "unnamed_files": ("files", "it writes 000000.depth, and its endings are ()"),
    "careless": ("leftovers", "there is still the open file"),
}
PROFILES: Mapping[str, tuple[str, str]] = {
    "unknown_key": ("profile", "did you mean 'thickness_mm'?"),
    "unknown_component": ("profile", "did you mean 'poisson'?"),
    "extends_nothing": ("profile", "there is no profile 'no_such_build'"),
    "absolute_path": ("profile_paths", "the absolute path '/home/lab/presses'"),
    "misnamed": ("profile_name", "it is named 'other' and its file 'misnamed.yaml'"),
    "shadowing": ("profile_name", "there is one of this name already (shipped)"),
    "unpicklable": ("pipeline", "its pipeline does not pickle"),
    "failing": ("pipeline", "RuntimeError: the weights do not fit"),
}
FAULTS = {**REGISTERED, **DEVICES, **CALIBRATIONS, **ESTIMATORS, **SINKS, **PROFILES}
ALSO = {
    "random": {"state", "instances", "pickling"},  # a random result breaks every comparison
    "shared": {"reset", "pickling"},  # what is in a class is neither reset nor pickled
    "leaks_thread": {"failed_opening"},
    "leaks_file": {"failed_opening"},
}


@pytest.fixture(autouse=True)
def faulty(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(FAKES)
    yield
    for name in [name for name in sys.modules if name.startswith("fake_faulty")]:
        del sys.modules[name]


def suite_of(name: str, **said: Any) -> type[PluginConformance]:
    return type("Suite", (PluginConformance,), {"plugin": name, **said})


def failures(suite: type[PluginConformance], *, imports: bool) -> dict[str, str]:
    """What each check that fails says."""
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
            except Unjudged:
                continue
    return found


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_caught_and_named(name: str) -> None:
    check, words = FAULTS[name]
    found = failures(suite_of(name, stall=stall), imports=False)
    assert set(found) - ALSO.get(name, set()) == {check}
    assert words in found[check]


@pytest.mark.parametrize("name", IMPORTED)
def test_what_an_import_must_not_do_is_caught_and_named(name: str) -> None:
    check, words = IMPORTED[name]
    found = failures(suite_of(name), imports=True)
    assert set(found) == {check}
    assert words in found[check]


def test_a_sound_plugin_passes() -> None:
    for name in ("sound", "depths"):
        assert failures(suite_of(name, stall=stall), imports=True) == {}


def test_a_plugin_that_is_not_installed_fails() -> None:
    (said,) = failures(suite_of("elsewhere"), imports=True).values()
    assert "run 'pip install tactile-elsewhere'" in said


@pytest.mark.parametrize("name", ["in_metres", "floats", "absolute_path"])
def test_a_fault_says_why_it_matters_and_what_to_do(name: str) -> None:
    (said,) = failures(suite_of(name), imports=False).values()
    assert name in said
    assert "\n  Why it matters: " in said
    assert "\n  What to do: " in said


def test_a_quantity_that_nobody_registers_can_be_given() -> None:
    def inputs(suite: PluginConformance, scene: VirtualPress) -> dict[type[Quantity], Quantity]:
        from fake_faulty.estimators import Temperature

        return {Temperature: Temperature(300.0)}

    found = failures(suite_of("needs_unknown", inputs=inputs), imports=False)
    assert set(found) == {"output"}
    assert "NotImplementedError" in found["output"]


def test_what_an_estimator_needs_is_made_by_the_plugins_others() -> None:
    from fake_faulty.estimators import Temperature

    registered, rig = suite_of("not_json").registered, generic_rig()
    truth = rig.scenes[0].truth
    made = completed(truth, [Temperature], registered, rig.context, without="not_json.y")
    assert made.keys() >= truth.keys() | {Temperature}
    without = completed(truth, [Temperature], registered, rig.context, without="not_json.x")
    assert Temperature not in without


def stall(suite: PluginConformance, camera: Any) -> bool:
    """Only the plugins whose fault it is can be stalled."""
    camera.stalled = "stalled" in suite.plugin
    return bool(camera.stalled)
