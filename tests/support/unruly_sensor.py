"""A sensor with a plugin that misbehaves on request."""

from __future__ import annotations

from pathlib import Path

FAKES = Path(__file__).resolve().parents[1] / "fakes" / "unruly"
"""Folder of the plugin; on ``sys.path`` it is installed."""


def profile(folder: Path, **parts: str) -> Path:
    """Write a profile whose components misbehave: ``step="value"``, ``camera="exit at open"``.

    ``box`` is the light driver.
    """
    lines = ["schema: 1", "name: unruly", "image: {width_px: 8, height_px: 6, mm_per_px: 0.1}"]
    for part in ("camera", "lights", "calibration", "step"):
        does, _, when = parts.get(part, "").partition(" at ")
        component = f"{{use: unruly.{part}, does: {does!r}, when: {when!r}}}"
        if part == "step":
            lines.append(f"estimators: {{height: {component}, contact: {{use: core.contact}}}}")
        elif part == "lights" and "box" in parts:
            does, _, when = parts["box"].partition(" at ")
            box = f"{{use: unruly.box, does: {does!r}, when: {when!r}}}"
            lines.append(f"illumination: {{use: unruly.lights, driver: {box}}}")
        elif part == "camera" or part in parts:
            lines.append(f"{'illumination' if part == 'lights' else part}: {component}")
    path = folder / "unruly.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path
