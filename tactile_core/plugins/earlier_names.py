"""Names of earlier versions in profiles, each with what to write instead."""

from __future__ import annotations

from collections.abc import Mapping

COMPONENTS: Mapping[str, str] = {
    "baxter_fingertip.four_sides": "write 'core.constant', and what each light feeds",
    "core.hdf5": "save 'record', which 'tactile convert' turns into HDF5",
    "core.shear_release": "remove the step, which 'core.slip' does not need any more",
    "core.tracking": "write 'core.marker_tracking'",
}

# Components that have left the core for distributions of their own, and their names there.
MOVED: Mapping[str, str] = {
    "core.dslr": "dslr.camera",
    "core.force_cnn": "networks.force_cnn",
    "core.genicam": "genicam.camera",
    "core.onnx": "networks.onnx",
    "core.rerun": "rerun.log",
    "core.virtual": "sim.virtual",
    "core.virtual_hand": "sim.hand",
}

# By the component, or by the keys of the mapping that held the key.
KEYS: Mapping[tuple[str, str], str] = {
    ("core.contact_shear", "tolerance"): "remove it",
    ("core.slip", "imprint_lost"): "write 'imprint_changed'",
    ("core.slip", "noise_mm"): "write it at the step 'core.contact_shear'",
    ("core.slip", "tolerance"): "remove it",
    ("core.slip", "window_mm"): "write it at the step 'core.contact_shear'",
    ("optics", "lamps"): "write 'lights'",
    ("optics", "marks"): "write 'markers'",
}
