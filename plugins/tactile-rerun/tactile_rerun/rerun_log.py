"""``rerun.log``: readings for the viewer rerun, as a file or live on this machine."""

from __future__ import annotations

import json
import socket
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import BaseModel, Field

from tactile_core.errors import InputError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.sink import Reading, Session, Sink
from tactile_core.quantities import HeightMap, Image, Quantity
from tactile_core.quantities.fields import Field as QuantityField
from tactile_core.quantities.fields import fields_of

if TYPE_CHECKING:
    import rerun

_APPLICATION = "tactile-core"
_LOOPBACK = "127.0.0.1"
_PATIENCE_S = 2.0  # Longest wait for a viewer, s


class RerunOptions(Options):
    """Options of ``rerun.log``."""

    port: int | None = Field(
        default=None,
        ge=1,
        le=65535,
        description="Port of a viewer on this machine, to which readings are sent instead of to a "
        "file. 'rerun' listens on 9876.",
    )


class RerunLog(Sink):
    """``NAME.rrd`` with all quantities, or a viewer that runs on this machine.

    Nothing is sent to another machine. Entities are ``camera``, ``height`` in mm, and
    ``<quantity>/<field>``, each with its unit and axes. Timelines are ``frame``, ``time``, which is
    the sensor's clock, and ``wall_time``.
    """

    Options: ClassVar[type[BaseModel]] = RerunOptions
    session_ending: ClassVar[str] = ".rrd"
    keeps_raw: ClassVar[bool] = True

    def __init__(self, options: RerunOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._stream: rerun.RecordingStream | None = None
        self._described: set[str] = set()

    def open(self, session: Session) -> None:
        """Create the file, or connect to the viewer."""
        super().open(session)
        import rerun

        self._rerun, self._described = rerun, set()
        port = self._settings.port
        if port is not None:
            _check_viewer(port)
        path = None if port is not None else self.new_path()
        stream = rerun.RecordingStream(_APPLICATION)
        if path is None:
            stream.connect_grpc(f"rerun+http://{_LOOPBACK}:{port}/proxy")
        else:
            stream.save(path)
        self._stream = stream

    def write(self, reading: Reading) -> None:
        """Log the images and quantities of a reading."""
        if self._stream is None:
            raise OSError("the rerun recording is closed")
        frame = reading.frame
        self._stream.set_time("frame", sequence=frame.sequence)
        self._stream.set_time("time", duration=frame.timestamp_s)
        if frame.wall_time_s > 0:
            self._stream.set_time("wall_time", timestamp=frame.wall_time_s)
        for name, image in frame.pictures().items():
            self._log(name, self._picture(image), "", ())
        for quantity in (*reading.quantities.values(), *reading.inputs.values()):
            with self.session.guard(quantity):
                self._log_quantity(quantity.finite())

    def close(self) -> None:
        """Complete the file, or leave the viewer."""
        if self._stream is not None:
            stream, self._stream = self._stream, None
            stream.flush(timeout_sec=_PATIENCE_S)
            stream.disconnect()

    def _log_quantity(self, quantity: Quantity) -> None:
        kind = type(quantity).__name__
        if isinstance(quantity, HeightMap):
            image = self._rerun.DepthImage(quantity.mm, meter=1000.0)  # [mm/m]
            self._log("height", image, "mm", ("y", "x"))
        for field in fields_of(type(quantity)):
            value = getattr(quantity, field.name)
            wanted = value is not None and not field.spec.shared
            if wanted and not (isinstance(quantity, HeightMap) and field.name == "mm"):
                logged = self._value(quantity, field)
                spec = field.spec
                self._log(f"{kind}/{field.name}", logged, spec.unit, spec.axes or ())

    def _log(self, path: str, logged: Any, unit: str, axes: tuple[str, ...]) -> None:
        assert self._stream is not None
        if path not in self._described and (unit or axes):
            about = self._rerun.AnyValues(unit=unit, axes=" ".join(axes))
            self._stream.log(path, about, static=True)
        self._described.add(path)
        self._stream.log(path, logged)

    def _picture(self, image: Image) -> Any:
        if image.encoded is not None:
            kind = "image/png" if image.encoded.startswith(b"\x89PNG") else "image/jpeg"
            return self._rerun.EncodedImage(contents=image.encoded, media_type=kind)
        return self._rerun.Image(image.pixels)

    def _value(self, quantity: Quantity, field: QuantityField) -> Any:
        value = getattr(quantity, field.name)
        if field.is_array:
            array = quantity.full(field.name) if field.spec.coarse else value
            if array.dtype.kind not in "biuf":
                return self._rerun.TextLog(json.dumps(array.tolist()))
            if array.dtype == np.bool_:
                array = array.astype(np.uint8)
            axes = field.spec.axes or ()
            names = axes if len(axes) == array.ndim else None
            return self._rerun.Tensor(np.ascontiguousarray(array), dim_names=names)
        if isinstance(value, bool | int | float):
            return self._rerun.Scalars(float(value))
        text = value if isinstance(value, str) else json.dumps(value, default=str)
        return self._rerun.TextLog(text)


def _check_viewer(port: int) -> None:
    """Make sure that a viewer listens; rerun itself would wait for one forever."""
    try:
        socket.create_connection((_LOOPBACK, port), timeout=_PATIENCE_S).close()
    except OSError:
        raise InputError(
            f"no rerun viewer listens on port {port} of this machine; start one with: "
            f"rerun --port {port}"
        ) from None
