"""What the page offers beside a sensor's own steps, and its state."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.bundles.bundle import Bundle, default_place
from tactile_core.errors import InputError, TactileError, words_of
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.sink import Reading
from tactile_core.live.numbers import Entry
from tactile_core.pipeline.chain import declared_step
from tactile_core.pipeline.parts import check_steps
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sensor import Sensor
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.profiles.model import Profile
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    HeightMap,
    Quantity,
    Wrench,
)
from tactile_core.sim.truth import TrueState


@dataclass(frozen=True, eq=False)
class LiveState:
    """What there is to show of a sensor after one observation.

    Attributes
    ----------
    number : int
        Counts the observations of this session.
    reading : Reading
    frame : Frame
        As the camera sent it.
    taken_s : float
        Host time at mid-observation; of a recording, when it was played.
    entries : tuple of Entry
        Numbers and words of the reading.
    faults : tuple of str
        What could not be read from it.
    rate_hz : float
        Observations a second.
    health : mapping
        As of ``tactile doctor --watch --json``.
    truth : TrueState or None
        Of a virtual sensor with a hand.
    failure : str
        Why there is no newer observation; empty if all is well.
    """

    number: int
    reading: Reading
    frame: Frame
    taken_s: float
    entries: tuple[Entry, ...]
    faults: tuple[str, ...]
    rate_hz: float
    health: dict[str, Any]
    truth: TrueState | None = None
    failure: str = ""


@dataclass(frozen=True)
class Sample:
    """The numbers of one observation, for the plots."""

    number: int
    taken_s: float
    values: dict[str, float]


def true_quantities(truth: TrueState) -> tuple[Quantity, ...]:
    """Return height, contact, displacement and force, as a perfect sensor would measure them."""
    everywhere = np.ones(truth.height_mm.shape, np.bool_)
    fx, fy, fz, tz = map(float, truth.wrench)
    return (
        HeightMap(truth.height_mm, everywhere, truth.mm_per_px, truth.time_s),
        ContactMask(truth.contact, truth.mm_per_px, truth.time_s),
        DisplacementField(truth.displacement_mm, everywhere, truth.mm_per_px, truth.time_s),
        Wrench(fx, fy, fz, tz, timestamp_s=truth.time_s),
    )


TRUTH = "truth"  # The choice that shows the truth of a virtual sensor


@dataclass(frozen=True)
class Choice:
    """One alternative that the page offers.

    Attributes
    ----------
    key : str
        Identifies it.
    title : str
    step, use : str
        The step and its estimator; empty for a calibration and for the truth.
    bundle : Path or None
        The calibration.
    """

    key: str
    title: str
    step: str = ""
    use: str = ""
    bundle: Path | None = None


@dataclass(frozen=True, eq=False)
class ShownComparison:
    """One frame, measured in two ways.

    Attributes
    ----------
    state : LiveState
        As the sensor measured it.
    title : str
        Of the other way.
    quantities : tuple of Quantity
        As the other way measured it.
    failure : str
        Why it measured nothing; empty if all is well.
    """

    state: LiveState
    title: str
    quantities: tuple[Quantity, ...] = ()
    latency_ms: float = 0.0
    failure: str = ""


def choices_for(sensor: Sensor, *, truth: bool, bundles: Iterable[Path] = ()) -> list[Choice]:
    """Return what a sensor's readings can be compared with.

    Every registered estimator that gives the same quantities as a step can take its place; every
    bundle of the profile in the user's data directory, and those given, can be the calibration.
    """
    profile = sensor.profile
    found = [Choice(TRUTH, "the truth")] if truth else []
    found += [
        Choice(f"{step}={use}", f"{step}: {use}", step, use)
        for step, component in profile.estimators.items()
        for use in _alike(profile, step, component.use)
    ]
    home = default_place(profile, sensor.serial).parent
    there = sorted(home.iterdir()) if home.is_dir() else []
    folders = [*bundles, *(folder for folder in there if (folder / "manifest.json").is_file())]
    found += [
        Choice(f"calibration={number}", f"calibration: {folder.name}", bundle=folder)
        for number, folder in enumerate(dict.fromkeys(folders))
    ]
    return found


def alternative_pipeline(sensor: Sensor, choice: Choice) -> Pipeline:
    """Return a pipeline that measures as the sensor does, but for this choice.

    Raises
    ------
    TactileError
        The estimator does not fit, or the bundle is of another sensor.
    """
    own = sensor.pipeline
    profile = (
        swap_estimator(sensor.profile, choice.step, choice.use) if choice.step else sensor.profile
    )
    bundle = own.bundle if choice.bundle is None else Bundle.load(choice.bundle)
    made = Pipeline(profile, bundle, own.reference, serial=sensor.serial)
    copied: Pipeline = pickle.loads(pickle.dumps(made))  # shares nothing with the other thread
    return copied


def swap_estimator(profile: Profile, step: str, use: str) -> Profile:
    """Return the profile with another estimator in a step; options that both have are kept."""
    kind = resolve("estimator", use)
    known = kind.Options.model_fields
    options = {k: v for k, v in profile.estimators[step].options.items() if k in known}
    component = Component.model_validate({"use": use, **options})
    return profile.model_copy(update={"estimators": {**profile.estimators, step: component}})


class AlternativeSteps:
    """Measures in a thread of its own; frames that come meanwhile are left out.

    Parameters
    ----------
    title : str
    pipeline : Pipeline
    """

    def __init__(self, choice: Choice, pipeline: Pipeline) -> None:
        self.choice, self._pipeline = choice, pipeline
        self.result: ShownComparison | None = None
        self._offered: LiveState | None = None
        self._there = threading.Condition()
        self._ends = False
        self._thread = threading.Thread(target=self._run, name=choice.key, daemon=True)
        self._thread.start()

    def offer(self, state: LiveState) -> None:
        """Offer a frame; it is measured if there is time for it."""
        with self._there:
            self._offered = state
            self._there.notify()

    def close(self) -> None:
        """End the thread."""
        with self._there:
            self._ends = True
            self._there.notify()

    def _run(self) -> None:
        while True:
            with self._there:
                self._there.wait_for(lambda: self._ends or self._offered is not None)
                state, self._offered = self._offered, None
            if self._ends or state is None:
                self._pipeline.close()
                return
            self.result = self._compare_state(state)

    def _compare_state(self, state: LiveState) -> ShownComparison:
        try:
            reading = self._pipeline.process(state.frame, *state.reading.inputs.values())
        except TactileError as error:
            return ShownComparison(state, self.choice.title, failure=str(error))
        except Exception as error:
            return ShownComparison(state, self.choice.title, failure=words_of(error))
        quantities = tuple(reading.quantities.values())
        return ShownComparison(state, self.choice.title, quantities, reading.latency_ms)


def find_choice(choices: Iterable[Choice], key: str) -> Choice:
    """Return the choice of this key.

    Raises
    ------
    InputError
        The page did not offer it.
    """
    for choice in choices:
        if choice.key == key:
            return choice
    raise InputError(f"there is no choice {key!r} to compare with; reload the page")


def _alike(profile: Profile, step: str, use: str) -> Iterator[str]:
    """Yield the names of the other estimators that can take the place of a step."""
    wanted = _gives(use)
    for plugin in list_plugins():
        for name in plugin.components.get("estimator", ()):
            other = f"{plugin.name}.{name}"
            try:
                if other != use and _gives(other) == wanted:
                    check_steps(swap_estimator(profile, step, other))
                    yield other
            except TactileError:
                continue  # a broken plugin, or one that does not fit here


def _gives(use: str) -> tuple[Any, ...]:
    kind = resolve("estimator", use)
    return declared_step(use, kind.__new__(kind)).gives
