"""The least force of a virtual sensor that is pressed and sheared by known forces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.bundles.bundle import Bundle
from tactile_core.evaluation.demo import calibrated_virtually
from tactile_core.evaluation.floor.least_force import Floor, estimates, floor_of
from tactile_core.interfaces.progress import Progress, Silent
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Wrench
from tactile_core.sim.stage import VirtualStage

_SHEAR = "fx", "fy"


class VIRTUAL_FLOOR:
    """What is pressed on the virtual sensor."""

    # [count] Frames without force, and again before every shear. Source: by hand, the quantile is
    # then close to the largest of them.
    rest_frames = 60
    # [count] Frames whose mean is the reference of a sensor without a bundle. Source: that of
    # ``capture_reference``.
    averaged = 10
    # [N] Normal force while the surface is sheared. Source: by hand, : a light grip, with fifty
    # times the shear force in question.
    held_n = 1.0
    # [mm] Displacement of the object between two readings. Source: by hand, : less than a
    # hundredth of a newton on the fingertip.
    shear_mm = 0.004
    # [count] Readings while the surface is sheared. Source: by hand, to two tenths of a newton on
    # the fingertip.
    shears = 25
    # [N] Normal forces at which readings are taken. Source: by hand, : around the least force of
    # the review's table 1.
    forces_n: tuple[float, ...] = (0.01, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 1)


_OBJECTS: dict[str, tuple[str, dict[str, float]]] = {
    "sphere 12 mm": ("sphere", {"diameter_mm": 12}),
    "cylinder 10 mm": ("cylinder", {"diameter_mm": 10, "length_mm": 8}),
    "flat 6 mm": ("flat", {"diameter_mm": 6}),
}


def virtual_floors(
    profile: Profile,
    bundle: Bundle | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[Floor]:
    """Press and shear three objects on a virtual sensor.

    Normal force is judged against the undeformed surface; shear force against a contact that is
    pressed and not yet sheared.

    Parameters
    ----------
    profile : Profile
        Loaded for simulation; with steps that give a :class:`~tactile_core.Wrench` or a
        :class:`~tactile_core.RelativeLoad`.
    bundle : Bundle, optional
        Default: a virtual calibration, if a step gives a wrench.
    seed : int
        Of the unit and of its noise.

    Raises
    ------
    InputError
        No step gives a force.
    """
    progress = progress or Silent()
    trial = Trial(profile, bundle, seed, progress)
    rest = trial.readings(VIRTUAL_FLOOR.rest_frames)
    floors = []
    for number, (name, (kind, sizes)) in enumerate(_OBJECTS.items()):
        progress.stage(f"pressing and shearing a {name}", 0.25)
        trial.place(kind, sizes)
        pressed = [trial.pressed(force_n) for force_n in VIRTUAL_FLOOR.forces_n]
        found = [key for key in rest[0] if key not in _SHEAR]
        for key in found:
            calm = [one[key] for one in rest]
            forces = [true["fz"] for true, _ in pressed]
            floors.append(floor_of(key, name, calm, forces, [one[key] for _, one in pressed]))
        for key in _SHEAR if _SHEAR[0] in rest[0] else ():
            trial.place(kind, sizes)
            trial.pressed(VIRTUAL_FLOOR.held_n)
            calm = [one[key] for one in trial.readings(VIRTUAL_FLOOR.rest_frames // 2)]
            sheared = list(trial.sheared(key))
            forces, readings = ([one[key] for one in side] for side in zip(*sheared, strict=True))
            floors.append(floor_of(key, name, calm, forces, readings))
        progress.fraction((number + 1) / len(_OBJECTS))
    return floors


class Trial:
    """A virtual sensor and its pipeline."""

    def __init__(
        self, profile: Profile, bundle: Bundle | None, seed: int, progress: Progress
    ) -> None:
        self._stage = VirtualStage(profile, seed)
        if bundle is None and Wrench in Pipeline(profile).gives:
            bundle = calibrated_virtually(profile, progress)
        progress.stage("reading without contact", 0.1)
        before = [self._stage.frame() for _ in range(VIRTUAL_FLOOR.averaged)]
        self._pipeline = Pipeline(profile, bundle, average(before))

    def place(self, kind: str, sizes: dict[str, float]) -> None:
        """Take another object, above the undeformed surface."""
        self._stage.reset()
        self._pipeline.reset()
        self._stage.indenter(kind, **sizes)
        self.readings(1)

    def readings(self, count: int) -> list[dict[str, float]]:
        """Estimates of so many frames."""
        return [estimates(self._pipeline.process(self._stage.frame())) for _ in range(count)]

    def pressed(self, force_n: float) -> tuple[dict[str, float], dict[str, float]]:
        """Press with a force; return true forces and estimates."""
        self._stage.press(force_n=force_n)
        return self._true(), self.readings(1)[0]

    def sheared(self, key: str) -> Iterator[tuple[dict[str, float], dict[str, float]]]:
        """Shear step by step along the axis of this estimate."""
        way_mm = VIRTUAL_FLOOR.shear_mm * np.array([key == "fx", key == "fy"], np.float64)
        for _ in range(VIRTUAL_FLOOR.shears):
            self._stage.shear(dx_mm=float(way_mm[0]), dy_mm=float(way_mm[1]))
            yield self._true(), self.readings(1)[0]

    def _true(self) -> dict[str, float]:
        fx, fy, fz, _ = map(float, self._stage.truth().wrench)
        return {"fx": fx, "fy": fy, "fz": fz}
