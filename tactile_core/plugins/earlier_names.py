"""Names of earlier versions in profiles, each with what to write instead."""

from __future__ import annotations

from collections.abc import Mapping

COMPONENTS: Mapping[str, str] = {
    "baxter_fingertip.four_sides": "write 'core.constant', and what each light feeds",
    "core.hdf5": "save 'record', which 'tactile convert' turns into HDF5",
    "core.shear_release": "remove the step, which 'core.slip' does not need any more",
    "core.tracking": "write 'core.marker_tracking'",
    "core.virtual": "write 'sim.virtual', of the distribution tactile-sim",
    "core.virtual_hand": "write 'sim.hand', of the distribution tactile-sim",
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
