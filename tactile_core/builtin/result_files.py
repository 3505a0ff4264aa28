"""``core.npz``, ``core.tmd``, ``core.png`` and ``core.ply``: files for each observation."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from tactile_core.interfaces.reading import Reading
from tactile_core.interfaces.sink import Sink
from tactile_core.quantities import Gradients, HeightMap
from tactile_core.quantities.layers import Layer


class Arrays(Sink):
    """``NAME.npz``: the arrays of all quantities, with their descriptions."""

    endings: ClassVar[tuple[str, ...]] = (".npz",)

    def write(self, reading: Reading) -> None:
        """Write the measured quantities and the external inputs."""
        from tactile_core.formats.npz import write_npz
        from tactile_core.formats.saved_quantities import arrays_of

        quantities = [*reading.quantities.values(), *reading.inputs.values()]
        arrays = arrays_of(quantities, mm_per_px=reading.frame.mm_per_px, guard=self.session.guard)
        self.write_file(reading, ".npz", partial(write_npz, arrays=arrays))


class Heights(Sink):
    """``NAME.tmd``: the height map in GelSight's format."""

    endings: ClassVar[tuple[str, ...]] = (".tmd",)

    def write(self, reading: Reading) -> None:
        """Write the height map, if there is one."""
        from tactile_core.formats.tmd import write_tmd

        height = reading.get(HeightMap)
        if height is not None:
            mm = height.finite().mm
            writer = partial(write_tmd, height_mm=mm, mm_per_px=height.mm_per_px)
            self.write_file(reading, ".tmd", writer)


class Mesh(Sink):
    """``NAME.ply``: the gel surface as a mesh in the sensor frame."""

    endings: ClassVar[tuple[str, ...]] = (".ply",)

    def write(self, reading: Reading) -> None:
        """Write the surface, if there is a height map."""
        from tactile_core.formats.ply import write_ply

        height = reading.get(HeightMap)
        if height is not None:
            points_mm = height.finite().points_mm
            self.write_file(reading, ".ply", partial(write_ply, points_mm=points_mm))


class Pictures(Sink):
    """``NAME.png``: a picture of the quantities; ``NAME_normals.png``: 16-bit normals."""

    endings: ClassVar[tuple[str, ...]] = (".png", "_normals.png")

    def write(self, reading: Reading) -> None:
        """Write the picture, if any quantity has one, and the normals, if there are slopes."""
        from tactile_core.formats.images import write_png
        from tactile_core.formats.normals import write_normals
        from tactile_core.views.pictures import picture_of

        layers: list[Layer] = []
        for quantity in reading.quantities.values():
            with self.session.guard(quantity):
                layers += quantity.finite().layers()
        picture = picture_of(reading.frame, layers, title=reading.source)
        if picture is not None:
            self.write_file(reading, ".png", partial(write_png, pixels=picture))
        gradients = reading.get(Gradients)
        if gradients is not None:
            writer = partial(write_normals, normals=gradients.finite().normals)
            self.write_file(reading, "_normals.png", writer)
