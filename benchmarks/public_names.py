"""The public names in Python on small inputs: ``python public_names.py OUT``.

It runs in the folder of ``output_hashes.py``, after the cases whose results it reads.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tactile_core import ContactMask, Gradients, HeightMap, Pipeline, open_sensor
from tactile_core.algorithms.poisson import integrate
from tactile_core.sim import VirtualStage

out = Path(sys.argv[1])
y, x = np.mgrid[0:48, 0:64] / 8
gx, gy = np.cos(x) * np.sin(y), np.sin(x) * np.cos(y)
mask = (x - 4) ** 2 + (y - 3) ** 2 < 8
solved = {
    f"{boundary}_{covered}": integrate(
        gx, gy, mm_per_px=0.125, boundary=boundary, mask=mask if covered else None
    )
    for boundary in ("neumann", "dirichlet")
    for covered in (False, True)
}
np.savez(out / "integrate.npz", **solved)

arrays = {}
shapes = {
    "sphere": {"diameter_mm": 6},
    "cylinder": {"diameter_mm": 5, "length_mm": 6, "angle_deg": 30},
    "flat": {"size_mm": (4, 3)},
    "cone": {"diameter_mm": 6, "apex_deg": 120},
    "heightmap": {"height_mm": solved["dirichlet_False"], "mm_per_px": 0.1},
}
for number, (kind, options) in enumerate(shapes.items()):
    stage = VirtualStage(
        "hex_fingertip", seed=number, mode="fast", overrides={"gel": {"friction": 0.4}}
    )
    stage.indenter(kind, x_mm=0.5, **options)
    stage.press(force_n=1.0)
    stage.shear(dx_mm=0.2, steps=2)
    stage.twist(degrees=2)
    stage.hold(seconds=0.2)
    truth = stage.truth()
    names = "height_mm gradients contact stick displacement_mm markers_px wrench time_s"
    arrays |= {f"{kind}_{name}": np.asarray(getattr(truth, name)) for name in names.split()}
    arrays[f"{kind}_frame"] = np.asarray(stage.frame().data)
np.savez(out / "stage.npz", **arrays)

data = Path("data/three_colour/objectfolder/presses")
bundle = "calibrate_models_core.polynomial/bundle"
with open_sensor("objectfolder.yaml", bundle=bundle, input=data) as sensor:
    assert isinstance(sensor.pipeline, Pipeline)
    reading = sensor.read()
np.savez(
    out / "reading.npz",
    height=reading[HeightMap].mm,
    contact=reading[ContactMask].mask,
    area=reading[ContactMask].area_mm2,
    gx=reading[Gradients].gx,
    gy=reading[Gradients].gy,
)
