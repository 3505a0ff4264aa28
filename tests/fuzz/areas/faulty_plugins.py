"""Plugins with one fault in one method."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

from fuzz import recipes
from fuzz.attempt import Attempt
from fuzz.sandbox import Sandbox

PACKAGE = Path(__file__).resolve().parents[1] / "plugin"
_PLACES = {
    "estimators": ("options", "init", "estimate", "estimate", "estimate", "tare", "reset"),
    "calibration": ("options", "smoothing", "fit", "measure", "measure", "save", "load"),
    "camera": ("options", "init", "open", "read", "read", "close"),
    "illumination": ("options", "init", "channels", "exposures", "lights"),
    "driver": ("options", "init", "attach", "open", "set", "set", "close"),
}
_WAYS = (
    *("ValueError", "KeyError", "IndexError", "ZeroDivisionError", "RuntimeError", "TypeError"),
    *("EOFError", "BrokenPipeError", "OSError", "MemoryError", "RecursionError", "StopIteration"),
    *("KeyboardInterrupt", "SystemExit", "AssertionError", "UnicodeDecodeError"),
    *("Exit", "Abort", "unprintable", "prints", "warns", "noise", "none", "text", "shape", "dtype"),
    *("gaps", "integers", "scalar", "empty", "huge", "endless"),
)


def faulty_parts(box: Sandbox, rng: Random) -> Attempt:
    """Return a command with a plugin component that raises, returns a wrong value or prints."""
    kind = rng.choice(tuple(_PLACES))
    place, way = rng.choice(_PLACES[kind]), rng.choice(_WAYS)
    if rng.random() < 0.12:
        kind, place = "import", rng.choice(("module", "hooks"))
    return attempt_of(box, kind, place, way, rng)


def attempt_of(box: Sandbox, kind: str, place: str, way: str, rng: Random) -> Attempt:
    """Write a profile with the faulty component and choose a command that uses it."""
    part = {"use": f"fuzzed.{kind}", "place": place, "way": way}
    words, step = list(recipes.RUN), ""
    profile = "small.yaml"
    if kind == "estimators":
        step = "peak"
        _extend(box, {"estimators": {step: part}})
        if place == "tare":
            words += ["--tare-frame", "0"]
    elif kind == "calibration":
        _extend(box, {"calibration": part})
        words = list(recipes.CALIBRATE)
    elif kind == "camera":
        _extend(box, {"camera": part})
        words = ["run", profile, "--bundle", "bundle", "--frames", "2", "--json"]
    elif kind == "illumination":
        _extend(box, {"illumination": part})
        words = ["run", profile, "--input", "frames", "--reference", "first", "--json"]
    elif kind == "driver":
        live = {"use": "fuzzed.camera", "place": "", "way": ""}
        _extend(box, {"camera": live, "illumination": {"use": "core.constant", "driver": part}})
        words = ["run", profile, "--bundle", "bundle", "--frames", "2", "--json"]
    else:
        words = rng.choice(
            (
                ["validate", "mine.yaml"],
                ["plugins", "--json"],
                ["doctor"],
                ["profiles", "--json"],
                ["calibrate", *recipes.CALIBRATE[1:], "--model", "fuzzed.calibration"],
            )
        )
        _extend(box, {"calibration": {"use": "fuzzed.calibration"}})
    words = ["mine.yaml" if word == profile else word for word in words]
    # a refusal by a validator of options is reported as the user's mistake
    refused = place == "options" and way in ("ValueError", "AssertionError", "UnicodeDecodeError")
    named = ("fuzzed",) if not refused and way not in ("KeyboardInterrupt", "Abort") else ()
    if step and place in ("estimate", "tare") and named:
        named = (*named, step)
    codes = {0, 1, 2, 130} if way in ("KeyboardInterrupt", "Abort") else {0, 1, 2}
    return Attempt(
        words,
        named=named,
        codes=frozenset(codes),
        plugins=(PACKAGE,),
        environment={"FUZZED": f"{place}:{way}" if kind == "import" else ""},
    )


def _extend(box: Sandbox, change: dict[str, object]) -> None:
    # JSON is YAML
    content = {"schema": 1, "name": "small", "extends": "small.yaml", **change}
    (box.work / "mine.yaml").write_text(json.dumps(content))
