"""A gel on this computer: the picture that a camera takes of it, by the lights that are on."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray
from support.light_box import LightBox

from tactile_core.profiles.loader import load_profile
from tactile_sim.stage import VirtualStage

Levels = NDArray[np.float64]
"""(L,) level of each light, 0..1."""


class LightHistory:
    """When lights changed, on the host's monotonic clock."""

    def __init__(self, lights: int) -> None:
        self._lock = Lock()
        self._changes: deque[tuple[float, Levels]] = deque([(0.0, np.zeros(lights))], maxlen=64)

    def change(self, levels: Levels) -> None:
        """The lights have these levels from now on."""
        with self._lock:
            self._changes.append((time.monotonic(), levels))

    def mean(self, begin_s: float, end_s: float) -> Levels:
        """Return the mean levels during an exposure."""
        with self._lock:
            changes = list(self._changes)
        ends = [since_s for since_s, _ in changes[1:]] + [np.inf]
        shares = [
            max(0.0, min(until_s, end_s) - max(since_s, begin_s)) / (end_s - begin_s)
            for (since_s, _), until_s in zip(changes, ends, strict=True)
        ]
        return np.asarray(
            sum(share * levels for share, (_, levels) in zip(shares, changes, strict=True))
        )


class LitBox(LightBox):
    """A light box at a pseudo-terminal, whose lights change before it acknowledges."""

    def __init__(self, lights: int = 6) -> None:
        self.history = LightHistory(lights)
        super().__init__(lights)

    def proper(self, words: tuple[str, ...]) -> bytes:
        if words[0] == "SET":
            self.history.change(np.array([int(level) for level in words[2:]]) / 255)
        return super().proper(words)


class LitGel:
    """A gel surface, rendered by the virtual rig under each of its lights, once for each state.

    Parameters
    ----------
    profile : str or Path
        A rig whose lights are sequential.
    overrides : mapping

    Attributes
    ----------
    stage : VirtualStage
        Move the object with it, then call :meth:`render`.
    lit : (H, W, L) uint8
        The frame of the virtual rig alone.
    stray : float
        Light of the room, in grey levels.
    """

    def __init__(self, profile: str | Path, overrides: Mapping[str, Any], seed: int = 1) -> None:
        dark = {"illumination": {"dark": True}}
        self.stray = 0.0
        self.stage = VirtualStage(load_profile(profile, overrides={**overrides, **dark}), seed=seed)
        self.render()

    def render(self) -> None:
        """Let the camera see the surface as it is now."""
        *lit, dark = self.stage.exposures()
        self.lit = np.concatenate(lit, axis=2)
        self._dark = dark[..., 0].astype(np.float32)
        self._added = self.lit.transpose(2, 0, 1).astype(np.float32) - self._dark

    def picture(self, levels: Levels, exposure: float = 1.0) -> NDArray[np.uint8]:
        """Return the (H, W) picture.

        Parameters
        ----------
        levels : (L,)
        exposure : float
            Exposure time as a multiple of that of the virtual rig.
        """
        light = self.stray + np.tensordot(levels, self._added, 1)
        pixels = self._dark + exposure * light
        return np.clip(np.rint(pixels), 0, 255).astype(np.uint8)


Seen = Callable[[float, float], Levels]
"""Returns the mean levels of the lights from one time to another, on the monotonic clock."""


class EmulatedShutter:
    """Paints the images of an emulated camera: what the lights show during each exposure.

    Parameters
    ----------
    gel : LitGel
    seen : callable
        Of the lights.
    nominal_us : float
        Exposure time of the virtual rig's pictures.
    readout_s : float
        From the end of an exposure to the image.
    triggered : bool
        Whether an exposure begins when the image is asked for; else the image arrives then.
    """

    def __init__(
        self,
        gel: LitGel,
        seen: Seen,
        nominal_us: float,
        *,
        readout_s: float = 0.0,
        triggered: bool = True,
    ) -> None:
        self._gel, self._seen, self._nominal_us = gel, seen, nominal_us
        self._readout_s, self._triggered = readout_s, triggered

    def __call__(self, exposure_us: float) -> NDArray[np.uint8]:
        """Return the next image."""
        exposure_s = exposure_us / 1e6
        ended_s = time.monotonic() + (exposure_s if self._triggered else -self._readout_s)
        time.sleep(max(0.0, ended_s - time.monotonic()))
        levels = self._seen(ended_s - exposure_s, ended_s)
        picture = self._gel.picture(levels, exposure_us / self._nominal_us)
        time.sleep(max(0.0, ended_s + self._readout_s - time.monotonic()))
        return picture
