"""Frames that do not show the calibrated gel as the reference does: warned of, or refused."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

import cv2
import numpy as np
from fuzz import recipes
from fuzz.attempt import Attempt
from fuzz.process import Outcome
from fuzz.sandbox import Sandbox
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]

LEAST_HEIGHT_MM, LEAST_AREA = 0.15, 0.1
"""Change of the height, and share of the contact's area, that may not pass without a warning."""


def foreign_frames(box: Sandbox, rng: Random) -> Attempt:
    """Measure a frame and an altered copy of it, or one of another sensor."""
    inputs = box.work / "lit" / "frames"
    presses = sorted((box.work / "lit" / "presses").iterdir())
    source = rng.choice([*presses, box.work / "lit.png"])
    own = np.asarray(cv2.imread(str(source)), np.uint8)
    name, alter = rng.choice(sorted(_ALTERATIONS.items()))
    inputs.mkdir()
    cv2.imwrite(str(inputs / "1_own.png"), own)
    cv2.imwrite(str(inputs / "2_other.png"), own)

    def corrupt(rng: Random) -> None:
        before = np.asarray(cv2.imread(str(inputs / "2_other.png")), np.uint8)
        cv2.imwrite(str(inputs / "2_other.png"), np.ascontiguousarray(alter(before, rng)))

    def judge(outcome: Outcome) -> Iterator[str]:
        if outcome.code != 0:
            return
        one, other = map(json.loads, outcome.stdout.splitlines())
        if one["warnings"]:
            yield f"a frame of the unit itself is warned of: {one['warnings'][0][:80]}"
        if _differs(one, other) and not other["warnings"]:
            yield f"measured in silence: {name}"

    return Attempt(list(recipes.RUN_LIT), corrupt=corrupt, judge=judge)


def _differs(one: dict[str, Any], other: dict[str, Any]) -> bool:
    height_mm = abs(one["max_height_mm"] - other["max_height_mm"])
    areas = one["contact_area_mm2"], other["contact_area_mm2"]
    return height_mm > LEAST_HEIGHT_MM or max(areas) - min(areas) > LEAST_AREA * max(*areas, 1)


def _cropped(pixels: Pixels, rng: Random) -> Pixels:
    height, width = pixels.shape[:2]
    share = rng.choice((0.6, 0.65, 0.7, 0.75, 0.8))
    h, w = round(share * height), round(share * width)
    top, left = rng.randrange(height - h + 1), rng.randrange(width - w + 1)
    return np.asarray(cv2.resize(pixels[top : top + h, left : left + w], (width, height)), np.uint8)


def _one_sided(pixels: Pixels, rng: Random) -> Pixels:
    ramp = np.linspace(1, 1 + rng.choice((0.15, 0.2, 0.3)), pixels.shape[1])[:, None]
    return np.clip(pixels * (ramp if rng.random() < 0.5 else ramp[::-1]), 0, 255).astype(np.uint8)


def _another_size(pixels: Pixels, rng: Random) -> Pixels:
    width = rng.choice((40, 79, 160))
    return np.asarray(cv2.resize(pixels, (width, rng.choice((30, 60, 120)))), np.uint8)


_ALTERATIONS: dict[str, Callable[[Pixels, Random], Pixels]] = {
    "channels swapped": lambda p, rng: p[..., rng.choice(((2, 1, 0), (1, 0, 2), (1, 2, 0)))],
    "turned": lambda p, rng: p[::-1, ::-1],
    "mirrored": lambda p, rng: p[:, ::-1] if rng.random() < 0.5 else p[::-1],
    "cropped": _cropped,
    "grey": lambda p, rng: np.repeat(p[..., rng.choice((0, 1, 2))][..., None], 3, axis=2),
    "one-sided light": _one_sided,
    "another size": _another_size,
    "another light": lambda p, rng: np.clip(p * rng.choice((0.5, 0.7, 1.4)), 0, 255).astype(
        np.uint8
    ),
    "negative": lambda p, rng: 255 - p,
    "even": lambda p, rng: np.full_like(p, rng.choice((60, 128, 200))),
    "noise": lambda p, rng: np.frombuffer(rng.randbytes(p.size), np.uint8).reshape(p.shape),
}
