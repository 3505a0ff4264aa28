import numpy as np

from tactile_core.quantities import Quantity
from tactile_core.testing import PluginConformance
from tactile_core.testing.virtual_presses import VirtualPress
from tactile_tactip.surface import SurfaceModel


class TestTacTip(PluginConformance):
    plugin = "tactip"

    def inputs(self, scene: VirtualPress) -> dict[type[Quantity], Quantity]:
        """A model of the scene's markers: the bundle of a unit would hold it."""
        from tactile_core.quantities import MarkerField

        markers = scene.truth[MarkerField]
        assert isinstance(markers, MarkerField)
        rng = np.random.default_rng(0)
        moved_px = rng.normal(0, 1, (60, len(markers.ids), 2))
        poses = moved_px[:, :2].mean(axis=1)
        pins_px = markers.reference_px.astype(np.float64)
        return {SurfaceModel: SurfaceModel.fit(pins_px, moved_px, poses)}
