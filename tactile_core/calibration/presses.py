"""Presses: what a recording shows of a ball, and the ball's surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.circles.circle import Circle
from tactile_core.algorithms.circles.start import DIFFERS, Start
from tactile_core.algorithms.contact import rim_share
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.heights.sphere import cap, fit_sphere, rest_height
from tactile_core.calibration.target_surface import MeasuredSphere
from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Bool, Float32, Frame, Gradients, Reference


@dataclass(frozen=True)
class BallSurface:
    """Surface of a gel where it follows a ball. All lengths are in px.

    Attributes
    ----------
    touch_px : (x, y)
        Point of first contact, where the slope is that of the undeformed gel.
    ball_radius_px : float
    dome_radius_px : float or None
        Radius of an undeformed domed gel; None for a flat one.
    shape : (height, width)
        Of the image; the apex of a dome is in its centre.
    """

    touch_px: tuple[float, float]
    ball_radius_px: float
    dome_radius_px: float | None
    shape: tuple[int, int]

    def spheres(self) -> list[tuple[np.ndarray, float]]:
        """Centres (x, y) and radii of the spheres whose caps add up to the height."""
        touch = np.asarray(self.touch_px)
        if self.dome_radius_px is None:
            return [(touch, self.ball_radius_px)]
        h, w = self.shape
        apex = np.array([w - 1, h - 1]) / 2
        # both centres and the point of first contact are collinear
        ball = apex + (touch - apex) * (1 + self.ball_radius_px / self.dome_radius_px)
        return [(ball, self.ball_radius_px), (apex, self.dome_radius_px)]

    def slopes(self, x: np.ndarray, y: np.ndarray) -> Float32:
        """(N, 2) slopes of the ball at N places, minus those of the undeformed gel."""
        slopes = np.zeros((len(x), 2))
        for centre_px, radius_px in self.spheres():
            offset = np.stack([x, y], 1) - centre_px
            depth_px = np.sqrt(np.maximum(radius_px**2 - (offset**2).sum(1), 1.0))
            slopes -= offset / depth_px[:, None]
        return slopes.astype(np.float32)

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(N,) sum of the heights of the spherical caps at N places, up to a constant."""
        height_px = np.zeros(len(x))
        for (x0, y0), radius_px in self.spheres():
            height_px += cap((x - x0) ** 2 + (y - y0) ** 2, radius_px)
        return height_px


class PRESS:
    """Parameters of selecting pixels of a press. Nothing sets them from outside.

    They follow from the geometry of a ball on a gel, not from the sensor: all lengths are ratios.
    """

    # [contact radii (ball radii in a grid)] Pixels within it count in a score. Source: definition
    # of the held-out score (``docs/reference/accuracy.md``).
    scored_contact_share = 0.8
    # [ratio] Undeformed training pixels per pixel on the ball. With fewer, small biases of
    # undeformed pixels add up to a tilted height map.
    undeformed_share = 0.25


# Beginning of the reason to exclude a press that belongs to another reference.
NOT_THIS_GEL = "it does not show the gel of the reference"


@dataclass(frozen=True, eq=False)
class FoundPress:
    """One ball in one frame, with its contact circle.

    Attributes
    ----------
    file : str
        The image's file name, for reports.
    frame : Frame
    circle : Circle
        Its centre is the point of first contact, where the slope is that of the undeformed gel.
    ball_radius_px : float
    in_grid : bool
        One of many balls in the frame, located by a target file.
    dome_radius_px : float or None
        Radius of an undeformed domed gel; None for a flat one.
    start : Start or None
        Start of the circle search, from this press alone; None if the circle is given.
    thickness_mm : float
        Thickness of the gel, which determines the height of the contact's rim.
    for_heights : bool
        Its training pixels are for a calibration that is fitted to heights instead of slopes.
    """

    file: str
    frame: Frame
    circle: Circle
    ball_radius_px: float
    in_grid: bool = False
    dome_radius_px: float | None = None
    start: Start | None = None
    thickness_mm: float = THICKNESS_MM
    for_heights: bool = False

    @property
    def used(self) -> bool:
        """Whether the press is good enough to fit on."""
        return self.circle.used

    @property
    def why(self) -> str:
        """Why it is not used; empty if it is."""
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
    def ball_diameter_mm(self) -> float:
        """Diameter of the ball."""
        return round(2 * self.ball_radius_px * self.frame.mm_per_px, 6)

    @property
    def scored_radius_px(self) -> float:
        """Radius within which pixels count in a score."""
        if self.in_grid:
            return PRESS.scored_contact_share * self.ball_radius_px
        return min(
            PRESS.scored_contact_share * self.circle.contact_radius_px,
            0.9 * self.ball_radius_px,  # its upper limit: nearer to the equator it is too steep
        )

    @property
    def on_ball(self) -> BallSurface:
        """True shape of the gel surface inside the contact."""
        h, w = self.frame.pixels.shape[:2]
        return BallSurface(self.centre_px, self.ball_radius_px, self.dome_radius_px, (h, w))

    def disc(self, radius_px: float) -> Bool:
        """(H, W) bool: pixels within ``radius_px`` of the centre."""
        h, w = self.frame.pixels.shape[:2]
        x0, y0 = self.circle.centre_px
        y_square = ((np.arange(h) - y0) ** 2)[:, None]
        return np.asarray(y_square + (np.arange(w) - x0) ** 2 < radius_px**2)

    def surface(self, radius_px: float) -> Bool:
        """(H, W) bool: the pixels of :meth:`disc` that show coating instead of a marker."""
        disc = self.disc(radius_px)
        return disc if self.frame.marker_mask is None else disc & ~self.frame.marker_mask

    def true_gradients(self, mask: Bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and (N, 2) slopes of the ball, minus those of the undeformed gel."""
        rows, columns = np.nonzero(mask)
        return rows, columns, self.on_ball.slopes(columns, rows)

    def area(self) -> Bool:
        """(H, W) bool: the contact."""
        return self.disc(self.circle.contact_radius_px)

    def scored_area(self) -> Bool:
        """(H, W) bool: pixels that count in a score."""
        return self.surface(self.scored_radius_px)

    def height_errors_mm(self, height_mm: Float32, mask: Bool) -> np.ndarray:
        """(N,) measured minus true height over a mask, less their mean difference."""
        rows, columns = np.nonzero(mask)
        error = height_mm[mask] - self.on_ball.heights(columns, rows) * self.frame.mm_per_px
        return np.asarray(error - error.mean())

    def sphere(self, height_mm: Float32) -> MeasuredSphere | None:
        """Compare the ball with the sphere in a measured height map.

        The circle only chooses the surroundings; the pixels follow from the heights.
        """
        # [contact radii] A sphere is fitted to the heights of a contact within this radius. Source:
        # by hand, twice the contact leaves room for a circle that is off by as much as its radius,
        # and contains undeformed surface.
        near = self.disc(2.0 * self.circle.contact_radius_px)
        height_px, rest_px = height_mm / np.float32(self.frame.mm_per_px), None
        if self.dome_radius_px is not None:
            shape = near.shape[0], near.shape[1]
            rest_px = rest_height(shape, mm_per_px=1.0, radius_mm=self.dome_radius_px)
        sphere = fit_sphere(height_px, near, rest_px=rest_px)
        if sphere is None:
            return None
        ball_px, radius_px = self.on_ball.spheres()[0]
        offset_px = float(np.hypot(*(ball_px - sphere.centre_px)))
        return MeasuredSphere(sphere.radius_px / radius_px, offset_px)

    def true_heights_mm(self, rows: np.ndarray, columns: np.ndarray) -> Float32:
        """(N,) height of the gel surface on the ball above the undeformed surface."""
        (x, y), radius_px = self.circle.centre_px, self.circle.contact_radius_px
        scale = self.frame.mm_per_px
        # [count] Points of the contact's rim at which its height is averaged
        around = np.linspace(0, 2 * np.pi, 32, endpoint=False)
        rim_x, rim_y = x + radius_px * np.cos(around), y + radius_px * np.sin(around)
        rim_px = self.on_ball.heights(rim_x, rim_y).mean()
        top_px = self.on_ball.heights(np.array([x]), np.array([y]))[0]
        share = rim_share(radius_px * scale, self.thickness_mm)
        level_px = rim_px - share * (top_px - rim_px)
        return np.asarray((self.on_ball.heights(columns, rows) - level_px) * scale, np.float32)

    def lighting(self, reference: Reference) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of the training pixels and the changes of their intensities."""
        sample = self.training()
        at = sample.rows, sample.columns
        return sample.gradients, self.frame.pixels[at].astype(np.float64) - reference.pixels[at]

    def training(self) -> Press:
        """Pixels to fit on: reliable ones on the ball, and some undeformed ones far from it.

        Between the balls of a grid no pixel is reliably undeformed; see
        :func:`~tactile_core.calibration.light_range.undeformed_press`.
        """
        # [ball radii] Largest radius of training pixels on a single ball. Closer to the equator the
        # gel surface has lifted off the ball, where the model sphere is no ground truth. Source: by
        # hand, on real three-colour presses.
        # [ball radii] The same for balls in a grid, which are pressed in deeper. Attached shadows
        # limit it. Source: by hand, on real grids of balls.
        trusted = 0.85 if self.in_grid else 0.75
        # [contact radii] Largest radius of training pixels, in radii of the contact that was found.
        # Nearer to the rim, smoothing and errors of the circle mix in gel surface that has left the
        # ball. It is less steep than the label says, so that the model would make the other slopes
        # too steep. Source: chosen on each two of three sets of presses among 0.6 to 0.95; on the
        # third it is within 0.02° of the best (ADR 46).
        # [contact radii] The same for a calibration that is fitted to heights: a rim that is a
        # pixel off changes the height less than the slope, and without it the heights of the lower
        # half are extrapolated. Source: definition of the contact.
        share = 1.0 if self.for_heights else 0.8
        radius = min(trusted * self.ball_radius_px, share * self.circle.contact_radius_px)
        rows, columns, slopes = self.true_gradients(self.surface(radius))
        # [ball radii] Pixels farther from the centre count as undeformed.
        distance_px = 3.5 * self.ball_radius_px
        undeformed = ~self.disc(np.inf if self.in_grid else distance_px)
        if self.frame.marker_mask is not None:
            undeformed &= ~self.frame.marker_mask
        level = np.flatnonzero(undeformed)
        count = min(len(level), int(PRESS.undeformed_share * len(rows)))
        pick = np.random.default_rng(0).choice(len(level), count, replace=False, shuffle=False)
        level_rows, level_columns = np.divmod(level[pick], undeformed.shape[1])
        return Press(
            frame=self.frame,
            rows=np.concatenate([rows, level_rows]).astype(np.int32),
            columns=np.concatenate([columns, level_columns]).astype(np.int32),
            gradients=np.concatenate([slopes, np.zeros((len(pick), 2), np.float32)]),
            name=self.file,
            heights_mm=np.concatenate(
                [self.true_heights_mm(rows, columns), np.zeros(len(pick), np.float32)]
            ),
        )

    def normal_errors_deg(self, measured: Gradients) -> np.ndarray:
        """Angle between measured and true normal of each scored pixel, degrees."""
        rows, columns, true = self.true_gradients(self.scored_area())
        slopes = np.stack([measured.x[rows, columns], measured.y[rows, columns]], 1)
        return angles_deg(slopes, true)


def angles_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the angles between the normals of two (N, 2) arrays of slopes, in degrees."""
    na = np.column_stack([a, np.ones(len(a))])
    nb = np.column_stack([b, np.ones(len(b))])
    sine = np.linalg.norm(np.cross(na, nb), axis=1)
    return np.asarray(np.degrees(np.arctan2(sine, (na * nb).sum(1))))


def select_usable(presses: Sequence[FoundPress]) -> list[FoundPress]:
    """Return the presses that are good enough to fit on.

    Raises
    ------
    CalibrationError
        There are none; the message has the most frequent reason.
    """
    good = [press for press in presses if press.circle.used]
    if not good:
        reasons = [press.circle.why for press in presses]
        most = max(set(reasons), key=reasons.count) if reasons else "there are no presses"
        if most == DIFFERS or most.startswith(NOT_THIS_GEL):
            raise CalibrationError(
                f"none of {len(presses)} presses can be used: {most}; or it is the reference that "
                f"is wrong"
            )
        raise CalibrationError(
            f"none of {len(presses)} presses can be used ({most}); check the ball's diameter, the "
            f"scale in the profile and that the reference shows the undeformed gel"
        )
    return good
