"""The bundle's ``report.html``: score, coverage, and every circle, the doubtful ones first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from tactile_core.calibration.target_surface import MeasuredSphere, TargetSurface
from tactile_core.views.html import figure, heading, page, paragraph, table
from tactile_core.views.shading import Rgb

if TYPE_CHECKING:
    from tactile_core.bundles.manifest import Manifest
    from tactile_core.calibration.score import Score


# Colours of outlines and plots, RGB.
_USED, _LEFT_OUT, _AXIS, _DOT = (70, 220, 120), (240, 90, 80), (150, 158, 165), (40, 90, 170)


_PICTURE_PX = 240  # [px] Height of a press's picture


def write_report(
    folder: Path,
    manifest: Manifest,
    presses: Sequence[TargetSurface],
    score: Score | None,
    *,
    basis: str,
    coverage: Mapping[str, float],
    notes: Sequence[str],
) -> None:
    """Write ``report.html`` into a bundle's folder."""
    good = [press for press in presses if press.used]
    parts = [] if score is None else _score_parts(score, coverage)
    if notes:
        parts += [heading("Notes"), *map(paragraph, notes)]
    parts += [
        heading("Calibration"),
        table(
            ["item", "value"],
            [
                ("model", manifest.model),
                ("serial", manifest.serial or "—"),
                ("gel", manifest.gel_id or "—"),
                ("fitted on", basis),
                ("ball and scale measured with", manifest.measured_with or "unknown"),
                ("used", f"{len(good)} of {len(presses)}"),
                *((f"coverage: {k}", v) for k, v in coverage.items()),
                *(
                    (f"light direction of {name}", f"{azimuth:.0f}°")
                    for name, azimuth in zip(
                        manifest.channels, manifest.channel_azimuth_deg, strict=True
                    )
                ),
            ],
        ),
        heading("Coverage"),
        figure(_coverage(good), "number of presses"),
        heading("Calibration target, the doubtful ones first"),
        *_pictures(presses, {} if score is None else score.spheres),
    ]
    left_out = [(press.file, press.why) for press in presses if not press.used]
    if left_out:
        parts += [heading("Presses not used"), table(["press", "reason"], left_out)]
    title = f"Calibration of {manifest.profile} {manifest.serial}".strip()
    (folder / "report.html").write_text(page(title, parts), encoding="utf-8")


def _score_parts(score: Score, coverage: Mapping[str, float]) -> list[str]:
    measured, true = score.samples[:, :2], score.samples[:, 2:]
    pitch = [np.degrees(np.arctan(np.hypot(*s.T))) for s in (true, measured)]
    # [degrees] Yaw is plotted for steeper slopes only. Source: by hand, yaw is undefined on level
    # gel.
    steep = pitch[0] > 5
    yaw = [np.degrees(np.arctan2(s[steep, 1], s[steep, 0])) for s in (true, measured)]
    # [degrees] Largest pitch in the plot. Source: by hand, slopes that a ball teaches end below it.
    return [
        heading("Score on held-out presses"),
        *map(paragraph, score.sentences(coverage)),
        paragraph(f"height RMSE: {1e3 * score.height_rmse_mm:.0f} µm"),
        figure(
            scatter(pitch[0], pitch[1], 0, 60),
            "pitch in degrees: measured (vertical) against true (horizontal)",
        ),
        figure(
            scatter(yaw[0], yaw[1], -180, 180),
            "yaw in degrees: measured (vertical) against true (horizontal)",
        ),
    ]


def _pictures(presses: Sequence[TargetSurface], spheres: Mapping[int, MeasuredSphere]) -> list[str]:
    """Return a picture of every frame with its circles, sorted by :func:`_doubt`."""
    by_frame: dict[int, list[int]] = {}
    for number in sorted(
        range(len(presses)), key=lambda i: _doubt(presses[i], spheres.get(i)), reverse=True
    ):
        by_frame.setdefault(id(presses[number].frame), []).append(number)
    return [
        figure(
            _overlay([presses[i] for i in numbers]),
            _caption(presses[numbers[0]], spheres.get(numbers[0])),
            photo=True,
        )
        for numbers in by_frame.values()
    ]


def _doubt(press: TargetSurface, sphere: MeasuredSphere | None) -> float:
    """Return how doubtful a press is, relative to its ball; infinite if it is not used."""
    if not press.used:
        return float("inf")
    if sphere is None or press.ball_diameter_mm is None:
        return 0.0
    ball_px = press.ball_diameter_mm / 2 / press.frame.mm_per_px
    return max(abs(sphere.radius_ratio - 1), sphere.offset_px / ball_px)


def _caption(press: TargetSurface, sphere: MeasuredSphere | None) -> str:
    if not press.used or sphere is None:
        return f"{press.file} {press.why}".strip()
    return (
        f"{press.file}: sphere of {sphere.radius_ratio:.2f} of the ball's radius, "
        f"{sphere.offset_px:.1f} px from the circle"
    )


def scatter(true: np.ndarray, measured: np.ndarray, low: float, high: float) -> Rgb:
    """Plot measured values (vertical) against true ones (horizontal) between two bounds."""
    plot_px, margin_px = 320, 34
    canvas = np.full((plot_px + 2 * margin_px,) * 2 + (3,), 255, np.uint8)
    first, last = margin_px, margin_px + plot_px

    def place(values: np.ndarray) -> np.ndarray:
        return np.asarray(first + (np.clip(values, low, high) - low) / (high - low) * plot_px)

    cv2.rectangle(canvas, (first, first), (last, last), _AXIS, 1)
    cv2.line(canvas, (first, last), (last, first), _AXIS, 1, cv2.LINE_AA)
    for x, y in zip(place(true), first + last - place(measured), strict=True):
        cv2.circle(canvas, (round(x), round(y)), 1, _DOT, -1, cv2.LINE_AA)
    for value, where in ((low, first), (high, last)):
        text = f"{value:g}"
        cv2.putText(canvas, text, (int(where) - 8, last + 18), 0, 0.4, (60, 60, 60), 1, 16)
        cv2.putText(canvas, text, (2, int(first + last - where) + 4), 0, 0.4, (60, 60, 60), 1, 16)
    return canvas


def _overlay(presses: Sequence[TargetSurface]) -> Rgb:
    """Return a frame with the outlines and centres of its presses, the first one on top."""
    picture = _rgb(presses[0])
    # [px] Height of a picture of several balls. Source: by hand, each ball is then large enough to
    # see.
    scale = (960 if len(presses) > 1 else _PICTURE_PX) / picture.shape[0]
    size = round(picture.shape[1] * scale), round(picture.shape[0] * scale)
    shrinks = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    picture = np.asarray(cv2.resize(picture, size, interpolation=shrinks), np.uint8)
    for press in reversed(presses):
        x, y = ((c + 0.5) * scale - 0.5 for c in press.centre_px)
        colour = _USED if press.used else _LEFT_OUT
        area = cv2.resize(press.area().view(np.uint8) * np.uint8(255), size)
        edges, _ = cv2.findContours(
            (area > 127).view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        cv2.drawContours(picture, edges, -1, colour, 1, cv2.LINE_AA)
        cv2.drawMarker(picture, (round(x), round(y)), colour, cv2.MARKER_CROSS, 8, 1, cv2.LINE_AA)
    return picture


def _coverage(presses: list[TargetSurface]) -> Rgb:
    count = np.zeros(presses[0].frame.pixels.shape[:2], np.float32)
    for press in presses:
        count += press.area()
    shades = (255 * count / max(count.max(), 1)).astype(np.uint8)
    picture = cv2.applyColorMap(shades, cv2.COLORMAP_VIRIDIS)[..., ::-1]
    factor = _PICTURE_PX / picture.shape[0]
    return np.asarray(
        cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_NEAREST), np.uint8
    )


def _rgb(press: TargetSurface) -> Rgb:
    pixels = press.frame.pixels
    scaled = (pixels.astype(np.float32) * (255 / press.frame.full_scale)).clip(0, 255)
    picture = scaled.astype(np.uint8)
    return picture if picture.shape[2] == 3 else np.repeat(picture[..., :1], 3, axis=2)
