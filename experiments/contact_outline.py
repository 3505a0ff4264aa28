"""Outline of virtual contacts: fast mode against accurate mode, and both against a fine grid.

    python -m experiments.contact_outline            # fast against accurate, all rigs
    python -m experiments.contact_outline --fine     # both against nodes 1 px apart, one rig

The distance of two outlines is Hausdorff's: the largest distance in px of any outline pixel of one
mask from the nearest outline pixel of the other, in both directions.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core import load_profile
from tactile_core.algorithms.force.elastic_layer import ElasticLayer
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_core.profiles.model import Profile
from tactile_sim.contact_step import ContactModel, Precision
from tactile_sim.gel_surface import GelSurface
from tactile_sim.indenters import make_indenter
from tactile_sim.modes import Mode
from tactile_sim.resampling import ImageSampler
from tactile_sim.truth import TrueState

RIGS = ("hex_fingertip", "baxter_fingertip", "desktop_six_led", "desktop_three_colour")
SHEAR_MM = 0.1
"""Shear after the press in every second case; the contact then slips partly."""
FINE = Precision(normal=1e-3, friction=2e-3, sweeps=3)


class Case(NamedTuple):
    """One press: object, depth in gel thicknesses, position in view widths, shear."""

    kind: str
    options: dict[str, Any]
    depth: float
    place: tuple[float, float]
    shear_mm: float


def cases(profile: Profile) -> Iterator[Case]:
    """Ball, cone and cylinder's end: two sizes or depths each, centred and not, some sheared."""
    view_mm = profile.image.width_px * profile.image.mm_per_px
    objects: tuple[tuple[str, dict[str, Any], float], ...] = (
        ("sphere", {"diameter_mm": 0.25 * view_mm}, 0.1),
        ("sphere", {"diameter_mm": 0.45 * view_mm}, 0.2),
        ("cone", {"half_angle_deg": 70.0, "diameter_mm": 0.3 * view_mm}, 0.15),
        ("cone", {"half_angle_deg": 60.0, "diameter_mm": 0.3 * view_mm}, 0.3),
        ("flat", {"diameter_mm": 0.15 * view_mm}, 0.05),
        ("flat", {"diameter_mm": 0.25 * view_mm}, 0.1),
    )
    for number, (kind, options, depth) in enumerate(objects):
        yield Case(kind, options, depth, (0.0, 0.0), SHEAR_MM * (number % 2))
        yield Case(kind, options, depth, (0.071, -0.043), SHEAR_MM * ((number + 1) % 2))


def pressed(profile: Profile, case: Case, surface: GelSurface) -> TrueState:
    """Press, then shear; return the truth."""
    thickness_mm = surface.gel.elastomer.thickness_mm
    view_mm = profile.image.width_px * profile.image.mm_per_px
    x_mm, y_mm = (view_mm * part for part in case.place)
    surface.indent_with(make_indenter(case.kind, **case.options), x_mm=x_mm, y_mm=y_mm)
    surface.press(depth_mm=case.depth * thickness_mm, steps=4)
    if case.shear_mm:
        surface.shear(dx_mm=case.shear_mm, steps=4)
    return surface.truth()


class FineSurface(GelSurface):
    """Gel surface on nodes 1 px apart."""

    def __init__(self, profile: Profile) -> None:
        super().__init__(profile, "fast")
        grid = SurfaceGrid.covering(*self._extent, profile.image.mm_per_px)
        self._model = ContactModel(ElasticLayer(grid, self.gel.elastomer), self.gel, FINE)
        self._sampler = ImageSampler(grid, self.image_shape, self.mm_per_px)
        self.reset()


def outline(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels of a mask that touch its outside."""
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0)
    return np.asarray(mask & (inner == 0))


def hausdorff_px(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Largest distance between the outlines of two masks."""
    outlines = outline(one), outline(other)
    distances = [
        cv2.distanceTransform((~seen).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        for seen in outlines
    ]
    return float(max(distances[1][outlines[0]].max(), distances[0][outlines[1]].max()))


def nodes_only(truth: TrueState) -> NDArray[np.bool_]:
    """Contact mask interpolated from the nodes, without refinement: the control."""
    return truth._sampler.mask(truth._state.contact, truth._places)


def main() -> None:
    """Print the distances of each case, and the largest of each rig."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rigs", nargs="*", default=RIGS)
    parser.add_argument("--fine", action="store_true", help="compare with nodes 1 px apart")
    given = parser.parse_args()
    modes: tuple[Mode, ...] = ("fast", "accurate")
    for rig in given.rigs:
        profile = load_profile(rig, sim=True)
        worst: list[tuple[float, ...]] = []
        for case in cases(profile):
            truths = [pressed(profile, case, GelSurface(profile, mode)) for mode in modes]
            fast, accurate = (truth.contact for truth in truths)
            row = [hausdorff_px(fast, accurate)]
            if given.fine:
                fine = pressed(profile, case, FineSurface(profile)).contact
                row += [hausdorff_px(fast, fine), hausdorff_px(accurate, fine)]
            row.append(hausdorff_px(nodes_only(truths[0]), accurate))
            worst.append(tuple(row))
            print(f"  {case.kind:7s} {fast.sum():6d} px²" + "".join(f"{px:6.1f}" for px in row))
        names = ["fast-accurate", *(["fast-fine", "accurate-fine"] if given.fine else []), "nodes"]
        largest = ", ".join(
            f"{name} {max(column):.1f}"
            for name, column in zip(names, zip(*worst, strict=True), strict=True)
        )
        print(f"{rig}: largest distance, px: {largest}", flush=True)


if __name__ == "__main__":
    main()
