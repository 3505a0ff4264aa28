"""From recorded presses of a known ball to pixels whose slope is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_core.algorithms.circles import (
    Circle,
    Light,
    PressImage,
    Start,
    find_circles,
    fit_light,
    locate,
)
from tactile_core.algorithms.contact_rim import rim_share
from tactile_core.algorithms.dome import cap, flat_equivalent
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibrator import Press
from tactile_core.interfaces.progress import Progress
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference

TRUSTED_BALL_FRACTION = 0.75
"""Nearer its equator the skin has lifted off the ball while the sphere pretends otherwise."""

TRUSTED_GRID_FRACTION = 0.85
"""Balls that stand in a grid are pressed in deep; beyond it lie attached shadows."""

TRUSTED_CONTACT_FRACTION = 0.95
SCORED_CONTACT_FRACTION = 0.8
REST_DISTANCE_BALLS = 3.5
REST_SHARE = 0.25
"""Resting pixels per pixel on the ball: with fewer, small biases at rest add up to a tilted map."""

_RIM_POINTS = 32


@dataclass(frozen=True, eq=False)
class FoundPress:
    """One ball in one frame, and the circle where it touches.

    Attributes
    ----------
    file : str
        The image's name, for people.
    frame : Frame
    circle : Circle
        Its centre is where the ball touched first: where the slope is that at rest.
    ball_radius_px : float
    in_grid : bool
        One of many balls in the frame, whose place a target tells.
    dome_radius_px : float or None
        Radius of a domed gel at rest; None for a flat one.
    start : Start or None
        What the press alone tells; None where its place is given.
    thickness_mm : float
        Of the gel, which says how high the surface stands at the rim of the contact.
    """

    file: str
    frame: Frame
    circle: Circle
    ball_radius_px: float
    in_grid: bool = False
    dome_radius_px: float | None = None
    start: Start | None = None
    thickness_mm: float = THICKNESS_MM

    @property
    def used(self) -> bool:
        """Whether the press is good enough to fit on."""
        return self.circle.used

    @property
    def why(self) -> str:
        """Why it is not."""
        return self.circle.why

    @property
    def centre_px(self) -> tuple[float, float]:
        """Centre of the circle, x and y."""
        return self.circle.centre_px

    @property
    def radius_px(self) -> float:
        """Radius of the contact."""
        return self.circle.contact_radius_px

    @property
    def scored_radius_px(self) -> float:
        """Pixels within it count in a score."""
        if self.in_grid:
            return SCORED_CONTACT_FRACTION * self.ball_radius_px
        return min(
            SCORED_CONTACT_FRACTION * self.circle.contact_radius_px, 0.9 * self.ball_radius_px
        )

    def disc(self, radius_px: float) -> Bool:
        """(H, W) bool: pixels within ``radius_px`` of the centre."""
        h, w = self.frame.pixels.shape[:2]
        x0, y0 = self.circle.centre_px
        return np.asarray(np.hypot(np.arange(w) - x0, np.arange(h)[:, None] - y0) < radius_px)

    def surface(self, radius_px: float) -> Bool:
        """(H, W) bool: those of them that show the coating and not a marker."""
        disc = self.disc(radius_px)
        return disc if self.frame.marker_mask is None else disc & ~self.frame.marker_mask

    def true_gradients(self, mask: Bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and (N, 2) slopes of the skin on the ball, less those at rest."""
        rows, columns = np.nonzero(mask)
        slopes = np.zeros((len(rows), 2))
        for centre_px, radius_px in self._spheres():
            offset = np.stack([columns, rows], 1) - centre_px
            depth_px = np.sqrt(np.maximum(radius_px**2 - (offset**2).sum(1), 1.0))
            slopes -= offset / depth_px[:, None]
        return rows, columns, slopes.astype(np.float32)

    def area(self) -> Bool:
        """(H, W) bool: the contact."""
        return self.disc(self.circle.contact_radius_px)

    def scored(self) -> Bool:
        """(H, W) bool: pixels that count in a score."""
        return self.surface(self.scored_radius_px)

    def height_errors_mm(self, height_mm: Float32, mask: Bool) -> np.ndarray:
        """(N,) measured height minus that of the skin on the ball over a mask, up to a constant."""
        rows, columns = np.nonzero(mask)
        error = height_mm[mask] - self._height_px(columns, rows) * self.frame.mm_per_px
        return np.asarray(error - error.mean())

    def true_heights_mm(self, rows: np.ndarray, columns: np.ndarray) -> Float32:
        """(N,) height of the gel surface on the ball over the undeformed surface."""
        (x, y), radius_px = self.circle.centre_px, self.circle.contact_radius_px
        scale = self.frame.mm_per_px
        around = np.linspace(0, 2 * np.pi, _RIM_POINTS, endpoint=False)
        rim_x, rim_y = x + radius_px * np.cos(around), y + radius_px * np.sin(around)
        rim_px = self._height_px(rim_x, rim_y).mean()
        top_px = self._height_px(np.array([x]), np.array([y]))[0]
        share = rim_share(radius_px * scale, self.thickness_mm)
        level_px = rim_px - share * (top_px - rim_px)
        return np.asarray((self._height_px(columns, rows) - level_px) * scale, np.float32)

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of the pixels to fit on, and how their intensities changed."""
        sample = self.training()
        at = sample.rows, sample.columns
        return sample.gradients, self.frame.pixels[at].astype(np.float64) - reference.pixels[at]

    def _height_px(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Sum of the caps' heights at N places, up to a constant."""
        height_px = np.zeros(len(x))
        for (x0, y0), radius_px in self._spheres():
            height_px += cap((x - x0) ** 2 + (y - y0) ** 2, radius_px)
        return height_px

    def _spheres(self) -> list[tuple[np.ndarray, float]]:
        """Centres (x, y) and radii in px of the spheres whose caps add up to the height."""
        touch = np.asarray(self.circle.centre_px)
        if self.dome_radius_px is None:
            return [(touch, self.ball_radius_px)]
        h, w = self.frame.pixels.shape[:2]
        apex = np.array([w - 1, h - 1]) / 2
        # both centres and the point where the spheres touch lie on one line
        ball = apex + (touch - apex) * (1 + self.ball_radius_px / self.dome_radius_px)
        return [(ball, self.ball_radius_px), (apex, self.dome_radius_px)]

    def training(self) -> Press:
        """Pixels to fit on: those that surely lie on the ball, and some that surely rest.

        Nothing surely rests between the balls of a grid; see :func:`undeformed_press`.
        """
        trusted = TRUSTED_GRID_FRACTION if self.in_grid else TRUSTED_BALL_FRACTION
        radius = min(
            trusted * self.ball_radius_px,
            TRUSTED_CONTACT_FRACTION * self.circle.contact_radius_px,
        )
        rows, columns, slopes = self.true_gradients(self.surface(radius))
        rest = ~self.disc(np.inf if self.in_grid else REST_DISTANCE_BALLS * self.ball_radius_px)
        if self.frame.marker_mask is not None:
            rest &= ~self.frame.marker_mask
        rest_rows, rest_columns = np.nonzero(rest)
        rng = np.random.default_rng(0)
        pick = rng.permutation(len(rest_rows))[: int(REST_SHARE * len(rows))]
        return Press(
            frame=self.frame,
            rows=np.concatenate([rows, rest_rows[pick]]).astype(np.int32),
            columns=np.concatenate([columns, rest_columns[pick]]).astype(np.int32),
            gradients=np.concatenate([slopes, np.zeros((len(pick), 2), np.float32)]),
            name=self.file,
            heights_mm=np.concatenate(
                [self.true_heights_mm(rows, columns), np.zeros(len(pick), np.float32)]
            ),
        )

    def normal_errors_deg(self, measured: Gradients) -> np.ndarray:
        """Angle between measured and true normal of each scored pixel, degrees."""
        rows, columns, true = self.true_gradients(self.scored())
        slopes = np.stack([measured.x[rows, columns], measured.y[rows, columns]], 1)
        return angles_deg(slopes, true)


def angles_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle between the normals of two (N, 2) fields of slopes, degrees."""
    na = np.column_stack([a, np.ones(len(a))])
    nb = np.column_stack([b, np.ones(len(b))])
    sine = np.linalg.norm(np.cross(na, nb), axis=1)
    return np.asarray(np.degrees(np.arctan2(sine, (na * nb).sum(1))))


def find_presses(
    files: Sequence[str],
    frames: Sequence[Frame],
    reference: Reference,
    ball_radius_px: float,
    *,
    dome_radius_px: float | None = None,
    thickness_mm: float = THICKNESS_MM,
    labels: Mapping[str, Circle] | None = None,
    progress: Progress | None = None,
) -> list[FoundPress]:
    """Find, in each frame, the circle where the ball touches; labels overrule what is found."""
    if labels is not None:
        missing = Circle((0.0, 0.0), 0.0, False, "it has no row in the labels", 0.0)
        return [
            FoundPress(
                file,
                frame,
                labels.get(frame.source, missing),
                ball_radius_px,
                dome_radius_px=dome_radius_px,
                thickness_mm=thickness_mm,
            )
            for file, frame in zip(files, frames, strict=True)
        ]
    touching_px = flat_equivalent(ball_radius_px, dome_radius_px)
    starts = []
    for number, frame in enumerate(frames, 1):
        starts.append(Start.of(press_image(frame, reference), touching_px))
        if progress:
            progress.fraction(0.3 * number / len(frames))
    circles = find_circles(
        starts, progress=lambda share: progress.fraction(0.3 + 0.7 * share) if progress else None
    )
    return [
        FoundPress(file, frame, circle, ball_radius_px, False, dome_radius_px, start, thickness_mm)
        for file, frame, circle, start in zip(files, frames, circles, starts, strict=True)
    ]


def refound(presses: Sequence[FoundPress]) -> list[FoundPress]:
    """Find the circles of some presses anew, as if there were no others."""
    circles = find_circles(_starts(presses))
    return [replace(press, circle=circle) for press, circle in zip(presses, circles, strict=True)]


def undeformed_press(presses: Sequence[FoundPress], reference: Reference) -> Press:
    """Resting pixels for a frame full of balls: of the reference, as many as of presses alone."""
    count = int(REST_SHARE * sum(len(press.training().rows) for press in presses))
    return at_rest(presses[0].frame, reference, count)


def at_rest(frame: Frame, reference: Reference, count: int) -> Press:
    """Pixels of the reference, all over the image, as a frame of skin at rest."""
    height, width = reference.pixels.shape[:2]
    rng = np.random.default_rng(0)
    return Press(
        frame=replace(frame, pixels=reference.pixels, marker_mask=reference.marker_mask),
        rows=rng.integers(0, height, count).astype(np.int32),
        columns=rng.integers(0, width, count).astype(np.int32),
        gradients=np.zeros((count, 2), np.float32),
        name="reference",
        heights_mm=np.zeros(count, np.float32),
    )


def press_image(frame: Frame, reference: Reference) -> PressImage:
    """Prepare a frame for circle finding."""
    return PressImage.prepare(
        frame.pixels,
        reference.pixels,
        full_scale=frame.full_scale,
        marker_mask=frame.marker_mask,
        reference_markers=reference.marker_mask,
    )


def light_of(presses: Sequence[FoundPress]) -> Light:
    """Fit the forward light of some presses."""
    return fit_light(_starts(presses), [press.circle for press in presses])


def relocated(press: FoundPress, light: Light) -> FoundPress:
    """Find a held-out press's circle anew, with a light that has never seen it."""
    (start,) = _starts([press])
    return replace(press, circle=locate(start, light))


def _starts(presses: Sequence[FoundPress]) -> list[Start]:
    starts = [press.start for press in presses if press.start is not None]
    assert len(starts) == len(presses), "a press whose place was given is not searched"
    return starts


def used(presses: Sequence[FoundPress]) -> list[FoundPress]:
    """Presses that are good enough to fit on.

    Raises
    ------
    CalibrationError
        None is, with the most frequent reason.
    """
    good = [press for press in presses if press.circle.used]
    if not good:
        reasons = [press.circle.why for press in presses]
        most = max(set(reasons), key=reasons.count) if reasons else "there are no presses"
        raise CalibrationError(
            f"none of {len(presses)} presses can be used ({most}); check the ball's diameter, the "
            f"scale in the profile and that the reference shows the untouched gel"
        )
    return good
