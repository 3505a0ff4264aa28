"""Times of images that go backwards, repeat, jump or are missing, in names and in recordings."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import pairwise
from random import Random

from fuzz import recipes
from fuzz.attempt import Attempt
from fuzz.process import Outcome
from fuzz.sandbox import Sandbox

_EPOCH_MS = 1_700_000_000_000


def clocks(box: Sandbox, rng: Random) -> Attempt:
    """Return a command on images with unusual times, in their names or in a recording."""
    return _named(box, rng) if rng.random() < 0.5 else _recorded(box, rng)


def unusual_times(count: int, rng: Random) -> list[float]:
    """Return times of images, s: regular ones with a fault or two."""
    times = [number / 25 for number in range(count)]
    for _ in range(rng.randrange(1, 3)):
        at = rng.randrange(1, count)
        kind = rng.randrange(5)
        if kind == 0:
            times[at:] = [time - 0.06 for time in times[at:]]
        elif kind == 1:
            times[at] = times[at - 1]
        elif kind == 2:
            times[at:] = [time + rng.choice((2.0, 3600.0, 1e7)) for time in times[at:]]
        elif kind == 3:
            times[at], times[at - 1] = times[at - 1], times[at]
        else:
            times = [time + rng.choice((-5.0, 1.7e9)) for time in times]
    return times


def _named(box: Sandbox, rng: Random) -> Attempt:
    """Rename images to times; a rising run of them is what their readings are timed by."""
    folder = box.work / "sheared" / "frames"
    images = sorted(folder.iterdir())
    times = unusual_times(len(images), rng)
    kind = rng.randrange(4)
    for number, (image, time_s) in enumerate(zip(images, times, strict=True)):
        name = (
            f"{time_s:.3f}",
            f"{time_s:g}",
            f"t{time_s:.2f}",
            str(_EPOCH_MS + round(1e3 * time_s)),
        )
        new = folder / f"{name[kind]}.png"
        image.rename(new if not new.exists() else folder / f"{name[kind]} ({number}).png")
    return Attempt(list(recipes.RUN_MARKED), judge=_rising)


def _recorded(box: Sandbox, rng: Random) -> Attempt:
    """Change the times in a recording."""
    listed = box.work / "tape" / "recording.jsonl"
    lines = [json.loads(line) for line in listed.read_text().splitlines()]
    images = [line["image"] for line in lines if "image" in line]
    for line, time_s in zip(images, unusual_times(len(images), rng), strict=True):
        line["timestamp_s"] = time_s
    if rng.random() < 0.2:
        rng.choice(images)["timestamp_s"] = rng.choice((math.nan, math.inf, -1e300, None, "now"))
    listed.write_text("".join(json.dumps(line) + "\n" for line in lines))
    words = list(rng.choice((recipes.RUN_FOLDER, recipes.RUN_FOLDER, recipes.CONVERT_FOLDER)))
    return Attempt(words, judge=_rising)


def _rising(outcome: Outcome) -> Iterator[str]:
    """Yield a fault if readings do not follow each other in time, and no message says so."""
    if outcome.code != 0 or b'"timestamp_s"' not in outcome.stdout:
        return
    readings = [json.loads(line) for line in outcome.stdout.splitlines()]
    times = [reading["timestamp_s"] for reading in readings]
    warned = outcome.stderr.strip() or any(reading["warnings"] for reading in readings)
    if not warned and any(not later > earlier for earlier, later in pairwise(times)):
        yield "times that do not rise are measured in silence"
