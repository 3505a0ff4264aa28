"""A sensor whose plugin does what it is told, however unruly."""

from __future__ import annotations

from pathlib import Path

FAKES = Path(__file__).resolve().parents[1] / "fakes" / "unruly"
"""Put it on ``sys.path``, and the plugin is installed."""


def profile(folder: Path, **parts: str) -> Path:
    """A profile whose parts do as they are told: ``step="value"``, ``camera="exit at open"``.

    ``box`` is the light driver.
    """
    lines = ["schema: 1", "name: unruly", "image: {width_px: 8, height_px: 6, mm_per_px: 0.1}"]
    for part in ("camera", "lights", "calibration", "step"):
        does, _, when = parts.get(part, "").partition(" at ")
        said = f"{{use: unruly.{part}, does: {does!r}, when: {when!r}}}"
        if part == "step":
            lines.append(f"estimators: {{height: {said}, contact: {{use: core.contact}}}}")
        elif part == "lights" and "box" in parts:
            does, _, when = parts["box"].partition(" at ")
            box = f"{{use: unruly.box, does: {does!r}, when: {when!r}}}"
            lines.append(f"illumination: {{use: unruly.lights, driver: {box}}}")
        elif part == "camera" or part in parts:
            lines.append(f"{'illumination' if part == 'lights' else part}: {said}")
    path = folder / "unruly.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path
