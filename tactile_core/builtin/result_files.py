"""Sinks that write files: arrays, heights, pictures, meshes and recordings."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import ClassVar

from pydantic import BaseModel, Field

from tactile_core.errors import InputError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.sink import OpenRecording, Reading, Session, Sink
from tactile_core.quantities import Gradients, HeightMap
from tactile_core.quantities.fields import Layer


class Arrays(Sink):
    """``NAME.npz``: the arrays of all quantities, with their descriptions."""

    endings: ClassVar[tuple[str, ...]] = (".npz",)

    def write(self, reading: Reading) -> None:
        """Write the measured quantities and the external inputs."""
        from tactile_core.formats.npz import arrays_of, write_npz

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
        from tactile_core.formats.tmd import write_ply

        height = reading.get(HeightMap)
        if height is not None:
            points_mm = height.finite().points_mm
            self.write_file(reading, ".ply", partial(write_ply, points_mm=points_mm))


class Pictures(Sink):
    """``NAME.png``: a picture of the quantities; ``NAME_normals.png``: 16-bit normals."""

    endings: ClassVar[tuple[str, ...]] = (".png", "_normals.png")

    def write(self, reading: Reading) -> None:
        """Write the picture, if any quantity has one, and the normals, if there are slopes."""
        from tactile_core.formats.images import write_normals, write_png
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


NAME = "recording.mcap"  # Name of the recording in the folder for results


class RecordOptions(Options):
    """Options of ``core.record``."""

    path: Path | None = Field(
        default=None,
        description="A new .mcap file, or a new folder. Default: recording.mcap in --out.",
    )
    readings: bool = Field(default=False, description="Whether the quantities are recorded, too.")


class Record(Sink):
    """What the camera sends, exactly, from the first reading to the last."""

    Options: ClassVar[type[BaseModel]] = RecordOptions

    def __init__(self, options: RecordOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._recording: OpenRecording | None = None

    def open(self, session: Session) -> None:
        """Start the recording."""
        super().open(session)
        path = self._settings.path
        if session.record is None:
            raise InputError("this sink needs a sensor, but these readings come from none")
        if path is None:
            if session.folder is None:
                raise InputError("this sink writes a file; name a folder for it with --out")
            path = session.folder.path / NAME
            path.parent.mkdir(parents=True, exist_ok=True)
        self._recording = session.record(path, self._settings.readings)

    def write(self, reading: Reading) -> None:
        """Do nothing: the sensor records."""

    def close(self) -> None:
        """Complete the recording.

        Raises
        ------
        OSError
            It ended early.
        """
        if self._recording is not None:
            self._recording.close()
            if self._recording.failure is not None:
                raise OSError(self._recording.failure)
