"""Results of the public Python API on small inputs: ``python public_names.py OUT``.

It runs in the folder of ``output_hashes.py``, after the cases whose results it reads.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core import ContactMask, Gradients, HeightMap, Pipeline, open_sensor
from tactile_core.algorithms.poisson import integrate
from tactile_sim import VirtualStage

TRUTH = ("height_mm", "gradients", "contact", "stick", "displacement_mm", "markers_px", "wrench")
OUT = Path(sys.argv[1])
Arrays = dict[str, Any]


def solved() -> Arrays:
    """Heights of one slope field, for each boundary condition."""
    y, x = np.mgrid[0:48, 0:64] / 8
    gx, gy = np.cos(x) * np.sin(y), np.sin(x) * np.cos(y)
    return {
        "neumann": integrate(gx, gy, mm_per_px=0.125),
        "dirichlet": integrate(gx, gy, mm_per_px=0.125, boundary="dirichlet"),
    }


def staged(kind: str, options: dict[str, Any], seed: int) -> Arrays:
    """Frame and ground truth of a shape that is pressed, sheared, twisted and held."""
    overrides = {"gel": {"friction": 0.4}}
    stage = VirtualStage("hex_fingertip", seed=seed, mode="fast", overrides=overrides)
    stage.indenter(kind, x_mm=0.5, **options)
    stage.press(force_n=1.0)
    stage.shear(dx_mm=0.2, steps=2)
    stage.twist(degrees=2)
    stage.hold(seconds=0.2)
    truth = stage.truth()
    arrays = {name: np.asarray(getattr(truth, name)) for name in TRUTH}
    return arrays | {"time_s": truth.time_s, "frame": stage.frame().pixels}


def main() -> None:
    """Write the results of each public name."""
    heights = solved()
    np.savez(OUT / "integrate.npz", **heights)
    shapes: dict[str, dict[str, Any]] = {
        "sphere": {"diameter_mm": 6},
        "cylinder": {"diameter_mm": 5, "length_mm": 6, "angle_deg": 30},
        "flat": {"size_mm": (4, 3)},
        "cone": {"half_angle_deg": 65},
        "heightmap": {"height_mm": heights["dirichlet"], "mm_per_px": 0.1},
    }
    for seed, (kind, options) in enumerate(shapes.items()):
        np.savez(OUT / f"stage_{kind}.npz", **staged(kind, options, seed))
    bundle = "calibrate_models_core.polynomial/bundle"
    with open_sensor("objectfolder.yaml", bundle=bundle, input="few_objectfolder") as sensor:
        assert isinstance(sensor.pipeline, Pipeline)
        reading = sensor.read()
    for quantity in (HeightMap, Gradients, ContactMask):
        arrays: Arrays = dict(reading[quantity].arrays())
        np.savez(OUT / f"{quantity.__name__}.npz", **arrays)


if __name__ == "__main__":
    main()
