"""The bundle's ``report.html``: what was known, coverage, measured against true pitch and yaw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from tactile_core.calibration.known_surface import KnownSurface
from tactile_core.views import html
from tactile_core.views.drawing import Rgb

if TYPE_CHECKING:
    from tactile_core.bundles.manifest import Manifest
    from tactile_core.calibration.scoring import Score


_FOUND, _REFUSED, _AXIS, _DOT = (70, 220, 120), (240, 90, 80), (150, 158, 165), (40, 90, 170)
_PLOT_PX = 320
_MARGIN_PX = 34
_MOST_PICTURES = 24


def write_report(
    folder: Path,
    manifest: Manifest,
    presses: Sequence[KnownSurface],
    score: Score | None,
    *,
    basis: str,
    coverage: Mapping[str, float],
    notes: Sequence[str],
) -> None:
    """Write ``report.html`` into a bundle's folder."""
    good = [press for press in presses if press.used]
    parts = [
        html.table(
            ["what", "value"],
            [
                ("model", manifest.model),
                ("serial", manifest.serial or "—"),
                ("fitted on", basis),
                ("used", f"{len(good)} of {len(presses)}"),
                *((f"coverage: {k}", v) for k, v in coverage.items()),
                *(
                    (f"light of {name} comes from", f"{azimuth:.0f}°")
                    for name, azimuth in zip(
                        manifest.channels, manifest.channel_azimuth_deg, strict=True
                    )
                ),
            ],
        )
    ]
    if notes:
        parts += [html.heading("Notes"), *map(html.paragraph, notes)]
    if score is not None:
        parts += _score_parts(score)
    parts += [html.heading("What was covered"), html.figure(_coverage(good), "coverage")]
    parts += [html.heading("What was known")]
    parts += [
        html.figure(_overlay(press), f"{press.file} {press.why}".strip())
        for press in presses[:_MOST_PICTURES]
    ]
    refused = [(press.file, press.why) for press in presses if not press.used]
    if refused:
        parts += [html.heading("Left out"), html.table(["press", "why"], refused)]
    title = f"Calibration of {manifest.profile} {manifest.serial}".strip()
    (folder / "report.html").write_text(html.page(title, parts), encoding="utf-8")


def _score_parts(score: Score) -> list[str]:
    measured, true = score.samples[:, :2], score.samples[:, 2:]
    pitch = [np.degrees(np.arctan(np.hypot(*s.T))) for s in (true, measured)]
    steep = pitch[0] > 5
    yaw = [np.degrees(np.arctan2(s[steep, 1], s[steep, 0])) for s in (true, measured)]
    return [
        html.heading("Error on held-out presses"),
        html.table(
            ["mean", "median", "90 %", "saying 'flat'", "height RMS"],
            [
                (
                    f"{score.mean_deg:.2f}°",
                    f"{score.median_deg:.2f}°",
                    f"{score.p90_deg:.2f}°",
                    f"{score.predict_flat_deg:.1f}°",
                    f"{1e3 * score.height_rmse_mm:.0f} µm",
                )
            ],
        ),
        html.figure(
            _scatter(pitch[0], pitch[1], 0, 60),
            "pitch: measured (up) against true (right), degrees",
        ),
        html.figure(
            _scatter(yaw[0], yaw[1], -180, 180), "yaw: measured (up) against true (right), degrees"
        ),
    ]


def _scatter(true: np.ndarray, measured: np.ndarray, low: float, high: float) -> Rgb:
    canvas = np.full((_PLOT_PX + 2 * _MARGIN_PX,) * 2 + (3,), 255, np.uint8)
    first, last = _MARGIN_PX, _MARGIN_PX + _PLOT_PX

    def place(values: np.ndarray) -> np.ndarray:
        return np.asarray(first + (np.clip(values, low, high) - low) / (high - low) * _PLOT_PX)

    cv2.rectangle(canvas, (first, first), (last, last), _AXIS, 1)
    cv2.line(canvas, (first, last), (last, first), _AXIS, 1, cv2.LINE_AA)
    for x, y in zip(place(true), first + last - place(measured), strict=True):
        cv2.circle(canvas, (round(x), round(y)), 1, _DOT, -1, cv2.LINE_AA)
    for value, where in ((low, first), (high, last)):
        text = f"{value:g}"
        cv2.putText(canvas, text, (int(where) - 8, last + 18), 0, 0.4, (60, 60, 60), 1, 16)
        cv2.putText(canvas, text, (2, int(first + last - where) + 4), 0, 0.4, (60, 60, 60), 1, 16)
    return canvas


def _overlay(press: KnownSurface) -> Rgb:
    picture = _rgb(press)
    scale = max(1, round(240 / picture.shape[0]))
    size = picture.shape[1] * scale, picture.shape[0] * scale
    picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_LINEAR), np.uint8)
    x, y = ((c + 0.5) * scale - 0.5 for c in press.centre_px)
    colour = _FOUND if press.used else _REFUSED
    area = cv2.resize(press.area().view(np.uint8) * np.uint8(255), size)
    edges, _ = cv2.findContours(
        (area > 127).view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    cv2.drawContours(picture, edges, -1, colour, 1, cv2.LINE_AA)
    cv2.drawMarker(picture, (round(x), round(y)), colour, cv2.MARKER_CROSS, 8, 1, cv2.LINE_AA)
    return picture


def _coverage(presses: list[KnownSurface]) -> Rgb:
    count = np.zeros(presses[0].frame.pixels.shape[:2], np.float32)
    for press in presses:
        count += press.area()
    shades = (255 * count / max(count.max(), 1)).astype(np.uint8)
    picture = cv2.applyColorMap(shades, cv2.COLORMAP_VIRIDIS)[..., ::-1]
    factor = 240 / picture.shape[0]
    return np.asarray(
        cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_NEAREST), np.uint8
    )


def _rgb(press: KnownSurface) -> Rgb:
    pixels = press.frame.pixels
    scaled = (pixels.astype(np.float32) * (255 / press.frame.full_scale)).clip(0, 255)
    picture = scaled.astype(np.uint8)
    return picture if picture.shape[2] == 3 else np.repeat(picture[..., :1], 3, axis=2)
