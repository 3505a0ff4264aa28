"""A hand that moves an object on a virtual sensor in real time, as somebody asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from threading import Lock
from typing import Any

from tactile_core.errors import InputError
from tactile_core.sim.gel_surface import GelSurface
from tactile_core.sim.indenters import make_indenter


class HAND:
    """Speeds and limits of the hand."""

    # [mm/s, mm/s and degrees/s] Fastest motion along the surface, up and down, and around.
    # Source: by hand, : calm motions of a person.
    speed_mm_s = 6.0
    lowering_mm_s = 1.5
    turning_deg_s = 60.0
    # [gel thicknesses] Deepest press. Source: the layer of elastomer is linear up to about a
    # third.
    deepest = 0.35
    # [s] Longest time of one step; a slower computer moves the object more slowly. Source: three
    # frames of a 30 Hz camera.
    longest_s = 0.1


@dataclass(frozen=True)
class Aim:
    """Where the object should be.

    Attributes
    ----------
    x_mm, y_mm : float
        Relative to the image centre.
    angle_deg : float
        Positive from x towards y.
    depth_mm : float
        Below first contact.
    pressed : bool
        Whether it touches the gel.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    angle_deg: float = 0.0
    depth_mm: float = 0.4
    pressed: bool = False


class Hand:
    """Moves an object towards its aim, as fast as :class:`HAND` allows.

    ``take`` and ``aim`` may be called from any thread.

    Parameters
    ----------
    surface : GelSurface

    Attributes
    ----------
    problem : str
        Why the object was let go; empty if all is well.
    """

    def __init__(self, surface: GelSurface) -> None:
        self._surface = surface
        self._lock = Lock()
        self._goal = self._at = Aim()
        self._object: tuple[str, dict[str, Any]] = ("sphere", {"diameter_mm": 5.0})
        self._taken = self._object
        self.problem = ""

    @property
    def deepest_mm(self) -> float:
        """Deepest press."""
        return HAND.deepest * self._surface.gel.elastomer.thickness_mm

    def take(self, kind: str, options: Mapping[str, Any]) -> None:
        """Choose the object; one that is pressed is released first.

        Raises
        ------
        InputError
            There is no such object.
        """
        make_indenter(kind, **options)
        with self._lock:
            self._object = (kind, dict(options))

    def aim(self, goal: Aim) -> None:
        """Choose where the object should be; the motion takes its time."""
        with self._lock:
            self._goal, self.problem = goal, ""

    def step(self, seconds: float) -> None:
        """Let time pass, and move towards the aim."""
        seconds = min(seconds, HAND.longest_s)
        with self._lock:
            goal, wanted = self._goal, self._object
        surface = self._surface
        try:
            if surface.pressed and (not goal.pressed or wanted != self._taken):
                surface.release(seconds)
            elif surface.pressed:
                self._move(goal, seconds)
            elif goal.pressed:
                self._press(goal, wanted, seconds)
            else:
                surface.hold(seconds)
        except InputError as error:  # for example beyond the border of the gel
            with self._lock:
                self._goal, self.problem = Aim(), str(error)

    def _press(self, goal: Aim, wanted: tuple[str, dict[str, Any]], seconds: float) -> None:
        kind, options = self._taken = wanted
        place = {"x_mm": goal.x_mm, "y_mm": goal.y_mm, "angle_deg": goal.angle_deg}
        self._surface.indent_with(make_indenter(kind, **options), **place)
        depth_mm = min(goal.depth_mm, self.deepest_mm, HAND.lowering_mm_s * seconds)
        self._surface.press(depth_mm=max(depth_mm, 1e-3), steps=1, seconds=seconds)
        self._at = Aim(**place, depth_mm=depth_mm, pressed=True)

    def _move(self, goal: Aim, seconds: float) -> None:
        at, far = self._at, HAND.speed_mm_s * seconds
        low, turn = HAND.lowering_mm_s * seconds, HAND.turning_deg_s * seconds
        dx, dy = goal.x_mm - at.x_mm, goal.y_mm - at.y_mm
        share = min(1.0, far / max((dx**2 + dy**2) ** 0.5, 1e-12))
        dx, dy = share * dx, share * dy
        degrees = _clamp_value(goal.angle_deg - at.angle_deg, turn)
        depth_mm = at.depth_mm + _clamp_value(
            min(goal.depth_mm, self.deepest_mm) - at.depth_mm, low
        )
        self._surface.move(dx, dy, degrees, depth_mm=max(depth_mm, 0.0), seconds=seconds)
        self._at = Aim(at.x_mm + dx, at.y_mm + dy, at.angle_deg + degrees, depth_mm, True)


def _clamp_value(value: float, most: float) -> float:
    return min(max(value, -most), most)
