"""Recorded and virtual presses compared: python docs/building/real_beside_virtual.py [DATA].

Measures both, writes the table of docs/reference/accuracy.md and the curves of
docs/explanation/real-and-virtual-images.md, and draws the images side by side into out/. These are
not committed, because the recordings may not be published.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from diagrams import Curve, Panel, write_sheet

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.formats.target import read_target
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_sim.optics import RigOptics
from tactile_sim.stage import VirtualStage

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "accuracy.md"
CURVES = ROOT / "docs" / "images" / "real_beside_virtual.svg"
PICTURES = ROOT / "out"
BEGIN, END = "<!-- measured: -->\n", "<!-- end -->\n"

HEX_BALL_MM = 3.96
HEX_AZIMUTHS_DEG = {"red": 67.3, "green": -177.6, "blue": -59.7}
"""Azimuths from a calibration on the two presses."""
HEX_UNIT = {
    "image": {"mm_per_px": 0.03026},
    "gel": {
        "markers": {"pitch_mm": 1.71, "diameter_mm": 0.43},
        # At each border the undeformed surface tilts towards the opposite light: a dome.
        "shape": "dome",
        "radius_mm": 24,
        "thickness_mm": 4,
        "crown_mm": None,
    },
    "illumination": {
        "lights": [
            {"name": name, "azimuth_deg": azimuth, "elevation_deg": 19}
            for name, azimuth in HEX_AZIMUTHS_DEG.items()
        ]
    },
}
HEX_PRESSES = {
    "Im_235_1336917.jpg": ((317.6, 252.0), 48.9),
    "Im_335_1337253.jpg": ((421.2, 107.9), 45.8),
}
"""Centre and contact radius from circle detection, px."""

GRID_AZIMUTHS_DEG = (-90, -151, 150, 91, 32, -29)
GRID_UNIT = {
    "image": {"mm_per_px": 0.0136152},
    "illumination": {
        # The recorded balls are brightest at a slope of 35°, so the lights are 35° from the
        # vertical.
        "lights": [
            {"name": f"light{k}", "azimuth_deg": azimuth, "elevation_deg": 56}
            for k, azimuth in enumerate(GRID_AZIMUTHS_DEG)
        ]
    },
}

_HALF_LINE = 1.3
_SAMPLES = 27
_INSIDE = slice(5, 22)
_TINT_BLUR_PX, _TINT_BORDER_PX = 20, 40


@dataclass(frozen=True, eq=False)
class Line:
    """Intensity of one channel along a line through a press towards its light."""

    channel: str
    virtual: np.ndarray
    real: np.ndarray

    @property
    def amplitude(self) -> float:
        """Peak-to-peak amplitude, virtual over real."""
        return float(np.ptp(self.virtual) / np.ptp(self.real))

    @property
    def correlation(self) -> float:
        """Correlation of virtual and real intensities."""
        return float(np.corrcoef(self.virtual, self.real)[0, 1])


@dataclass(frozen=True, eq=False)
class Pair:
    """One press, real and virtual; images are (H, W, K) float.

    ``lines`` are shading profiles through the press. ``bare`` is the (H, W) mask of pixels without
    a marker in any image.
    """

    title: str
    channels: tuple[str, ...]
    real_rest: np.ndarray
    real: np.ndarray
    virtual_rest: np.ndarray
    virtual: np.ndarray
    lines: tuple[Line, ...]
    bare: np.ndarray

    @cached_property
    def mean(self) -> np.ndarray:
        """(K,) mean of the reference image, virtual over real."""
        return np.asarray(self.virtual_rest.mean((0, 1)) / self.real_rest.mean((0, 1)))

    @cached_property
    def spread(self) -> np.ndarray:
        """(K,) standard deviation of the reference image, virtual over real."""
        return np.asarray(self.virtual_rest.std((0, 1)) / self.real_rest.std((0, 1)))

    @cached_property
    def change(self) -> np.ndarray:
        """(K,) standard deviation of the difference image, virtual over real."""
        virtual, real = self.virtual - self.virtual_rest, self.real - self.real_rest
        return np.asarray(virtual[self.bare].std(0) / real[self.bare].std(0))

    @cached_property
    def tint(self) -> np.ndarray:
        """(K,) correlation over the image of each colour's share in the reference image."""
        virtual, real = (_shares(image, self.bare) for image in (self.virtual_rest, self.real_rest))
        count = len(self.channels)
        return np.array([np.corrcoef(virtual[k], real[k])[0, 1] for k in range(count)])


def hex_pairs(data: Path) -> list[Pair]:
    """Two ball presses on the three-colour fingertip."""
    folder = data / "three_colour" / "hex_fingertip"
    profile = load_profile("hex_fingertip", overrides=HEX_UNIT)
    stage = VirtualStage(profile, seed=3)
    rest, real_rest = stage.frame().pixels.astype(float), _read(folder / "frame0.jpg")
    pairs = []
    for number, (name, (centre, radius_px)) in enumerate(HEX_PRESSES.items(), 1):
        press_until(stage, profile, centre, radius_px)
        seen, real = stage.frame().pixels.astype(float), _read(folder / name)
        lines = tuple(
            Line(colour, *(along(image[..., k], centre, azimuth, radius_px) for image in changes))
            for changes in [(seen - rest, real - real_rest)]
            for k, (colour, azimuth) in enumerate(HEX_AZIMUTHS_DEG.items())
        )
        surface = bare(rest, seen, real_rest, real)
        title = f"three colours, press {number}"
        channels = tuple(HEX_AZIMUTHS_DEG)
        pairs.append(Pair(title, channels, real_rest, real, rest, seen, lines, surface))
    return pairs


def press_until(
    stage: VirtualStage, profile: Profile, centre: tuple[float, float], radius_px: float
) -> None:
    """Press the ball until the contact has this radius."""
    image = profile.image
    middle = np.array([image.width_px - 1, image.height_px - 1]) / 2
    x_mm, y_mm = (np.array(centre) - middle) * image.mm_per_px
    stage.reset()
    stage.indenter("sphere", diameter_mm=HEX_BALL_MM, x_mm=float(x_mm), y_mm=float(y_mm))
    low, high = 0.0, HEX_BALL_MM / 2
    for _ in range(7):
        depth_mm = (low + high) / 2
        stage.press(depth_mm=depth_mm)
        wide = stage.truth().contact.sum() > np.pi * radius_px**2
        low, high = (low, depth_mm) if wide else (depth_mm, high)


def grid_pair(data: Path) -> Pair:
    """Six sequential lights over a ball grid; only the balls are scored."""
    folder = data / "six_led" / "ball_grid"
    profile = load_profile("desktop_six_led", overrides=GRID_UNIT)
    real, real_rest = (_scan(folder / name) for name in ("BGA-001", "Flat-001"))
    grid = read_target(folder / "BGA-001" / "bgatarget.yaml")
    # The target's coordinates refer to images of four times the size.
    centres = (np.asarray(grid.centres_px) - 1.5) / 4
    scale, shape = profile.image.mm_per_px, real.shape[:2]
    presses = [BallPress((x, y), 2 * grid.radius_mm, 0.5 * grid.radius_mm) for x, y in centres]
    height = np.max([press.height_mm(shape, scale) for press in presses], axis=0)
    optics = RigOptics(profile, seed=3, mode="accurate")
    rest, seen = (optics.expose(h).astype(float) for h in (np.zeros(shape), height))
    reach_px = grid.radius_mm / scale
    border = np.array([40, 40])
    whole = [c for c in centres if (c > border).all() and (c < shape[::-1] - border).all()]
    lines = []
    for k, azimuth in enumerate(GRID_AZIMUTHS_DEG):
        virtual, recorded = (
            np.median([along(image[..., k], c, azimuth, reach_px) for c in whole], axis=0)[_INSIDE]
            for image in (seen / rest, real / real_rest)
        )
        lines.append(Line(f"light {k + 1}", virtual, recorded))
    everywhere = np.ones(shape, bool)
    title = "six lights, ball grid"
    channels = tuple(line.channel for line in lines)
    return Pair(title, channels, real_rest, real, rest, seen, tuple(lines), everywhere)


def along(
    image: np.ndarray, centre: Sequence[float], azimuth_deg: float, reach_px: float
) -> np.ndarray:
    """(N,) intensities along a line through a press towards a light."""
    way = np.linspace(-_HALF_LINE, _HALF_LINE, _SAMPLES) * reach_px
    x = centre[0] + way * np.cos(np.radians(azimuth_deg))
    y = centre[1] + way * np.sin(np.radians(azimuth_deg))
    smooth = cv2.GaussianBlur(cv2.medianBlur(image.astype(np.float32), 5), (0, 0), reach_px / 15)
    at = x[None].astype(np.float32), y[None].astype(np.float32)
    return np.asarray(cv2.remap(smooth, *at, cv2.INTER_LINEAR)[0])


def bare(*images: np.ndarray) -> np.ndarray:
    """(H, W) bool: pixels without a marker in any of the images."""
    marked = np.zeros(images[0].shape[:2], bool)
    for image in images:
        grey = cv2.GaussianBlur(image.mean(2).astype(np.float32), (0, 0), 1)
        dark = (cv2.blur(grey, (41, 41)) - grey > 20).astype(np.uint8)
        marked |= cv2.dilate(dark, np.ones((9, 9), np.uint8)) > 0
    return ~marked


def _shares(image: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """(K, N) smoothed share of each colour, without markers and the image border."""
    weight = surface.astype(np.float32)
    total = cv2.GaussianBlur(image * weight[..., None], (0, 0), _TINT_BLUR_PX)
    smooth = total / np.maximum(cv2.GaussianBlur(weight, (0, 0), _TINT_BLUR_PX), 1e-3)[..., None]
    inner = smooth[_TINT_BORDER_PX:-_TINT_BORDER_PX:8, _TINT_BORDER_PX:-_TINT_BORDER_PX:8]
    return np.asarray((inner / inner.sum(2, keepdims=True)).reshape(-1, image.shape[2]).T)


def _read(path: Path) -> np.ndarray:
    return np.asarray(cv2.imread(str(path)))[..., ::-1].astype(float)


def _scan(folder: Path) -> np.ndarray:
    """(H, W, 6) images of one scan at a quarter of the recorded size."""
    images = [cv2.imread(str(p), cv2.IMREAD_GRAYSCALE) for p in sorted(folder.glob("image*.png"))]
    quarter = {"fx": 0.25, "fy": 0.25, "interpolation": cv2.INTER_AREA}
    return np.dstack([cv2.resize(image, None, **quarter) for image in images]).astype(float)


def tables(pairs: Sequence[Pair]) -> str:
    """Tables of the page: virtual over real, so 1 is perfect agreement."""
    lines = ["| image | channel | mean, reference | spread, reference | spread of the change | "]
    lines[0] += "shading: amplitude | shading: correlation |"
    lines.append("| --- | --- | --- | --- | --- | --- | --- |")
    for pair in pairs:
        for k, line in enumerate(pair.lines):
            numbers = (pair.mean[k], pair.spread[k], pair.change[k], line.amplitude)
            cells = [f"{number:.2f}" for number in (*numbers, line.correlation)]
            lines.append(f"| {pair.title} | {line.channel} | {' | '.join(cells)} |")
    tint = pairs[0].tint
    values = ", ".join(f"{t:.2f} ({c})" for c, t in zip(pairs[0].channels, tint, strict=True))
    lines += [
        "",
        f"Colour distribution over the three-colour reference image: correlation {values}.",
    ]
    return "\n".join(lines) + "\n"


def panels(pairs: Sequence[Pair]) -> list[Panel]:
    """Shading profiles: recorded solid, virtual dashed."""
    colours = {"red": "#c8362f", "green": "#2f8f4e", "blue": "#2f62b4"}
    drawn = []
    for pair in pairs:
        shown = pair.lines[:: max(1, len(pair.lines) // 3)]
        values = np.concatenate([[*line.real, *line.virtual] for line in shown])
        step = 20 if np.ptp(values) > 5 else 0.2
        low, high = step * np.floor(values.min() / step), step * np.ceil(values.max() / step)
        of = "contact radii" if len(pair.channels) == 3 else "ball radii"
        way = np.linspace(-_HALF_LINE, _HALF_LINE, _SAMPLES)
        way = way if len(shown[0].real) == _SAMPLES else way[_INSIDE]
        name = "change of intensity" if step == 20 else "intensity / reference"
        panel = Panel(
            pair.title,
            (f"towards the light, {of}", round(float(way[0]), 2), round(float(way[-1]), 2)),
            (name, float(low), float(high)),
        )
        for line, colour in zip(shown, colours.values(), strict=True):
            panel.curves += [
                Curve(line.channel, colour, way, line.real),
                Curve("", colour, way, line.virtual, dashed=True),
            ]
        drawn.append(panel)
    return drawn


def main() -> None:
    """Measure, write the tables and curves, and draw the pictures."""
    default = ROOT.parent / "shared" / "data"
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    if not data.is_dir():
        sys.exit(f"there are no recordings in {data}; give their folder")
    pairs = [*hex_pairs(data), grid_pair(data)]
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(f"{before}{BEGIN}\n{tables(pairs)}\n{END}{after}", encoding="utf-8")
    write_sheet(CURVES, panels(pairs), columns=3)
    PICTURES.mkdir(exist_ok=True)
    for number, pair in enumerate(pairs):
        rows = [(pair.real_rest, pair.virtual_rest), (pair.real, pair.virtual)]
        sheet = np.vstack([np.hstack([image[..., :3] for image in row]) for row in rows])
        path = PICTURES / f"real_beside_virtual_{number}.png"
        cv2.imwrite(str(path), np.clip(sheet[..., ::-1], 0, 255).astype(np.uint8))
        print(f"{path}: recorded left, virtual right")
    print(tables(pairs))


if __name__ == "__main__":
    main()
