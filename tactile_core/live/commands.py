"""What a page may ask, and the messages for it."""

from __future__ import annotations

import json
import struct
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from tactile_core.errors import InputError

_ALIGNED = 8  # Arrays begin at a multiple of this, as a browser's typed arrays need it


class Parts:
    """Collects what follows the header of a message."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def picture(self, encoded: bytes) -> dict[str, int]:
        """Add an encoded picture; return where it is."""
        at = self._size
        padding = -len(encoded) % _ALIGNED
        self._parts += [encoded, b"\0" * padding]
        self._size += len(encoded) + padding
        return {"at": at, "bytes": len(encoded)}

    def array(self, values: NDArray[Any]) -> dict[str, Any]:
        """Add an array of uint8, uint16, int16 or float32; return where and what it is."""
        values = np.ascontiguousarray(values)
        little = values.astype(values.dtype.newbyteorder("<"), copy=False)
        place = self.picture(little.tobytes())
        return {**place, "type": values.dtype.name, "shape": list(values.shape)}

    def message(self, header: dict[str, Any]) -> bytes:
        """Return the whole message: length of the header, header, and the parts."""
        words = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
        words += b" " * (-(4 + len(words)) % _ALIGNED)
        return b"".join([struct.pack("<I", len(words)), words, *self._parts])


class PAGE:
    """Sizes, rates and limits of the live page."""

    # [Hz] Largest number of pictures a second that a browser gets of one sensor. Source: motion
    # looks smooth from about 25 a second; more would take time from measuring.
    pictures_per_s = 30.0
    # [px] Longest side of the camera's picture and of a map as they are sent; larger ones are
    # reduced. Source: widths of a panel of the page on common screens.
    picture_px = 960
    map_px = 320
    # [percent] Quality of the camera's picture. Source: by hand, : artefacts are invisible.
    jpeg_quality = 80
    arrows_across = 24  # [count] Arrows along the longer side of a field of vectors
    # [s] Length of the plots. Source: by hand, : some grasps are on the screen together.
    history_s = 30.0
    health_s = 0.5  # [s] Time between two looks at the health
    # [count] Observations that are averaged for a reference. Source: as in
    # ``Sensor.capture_reference``.
    reference_frames = 10
    # [bytes] Longest message that a browser may send. Source: the longest command has about 1 kB.
    message_bytes = 16384
    # [count] Pages and sensors that are watched at the same time. Source: by hand, : four pages
    # of four sensors.
    browsers = 16
    # [s] Time in which a new connection must send its request. Source: by hand, : a slow network
    # needs less than one second.
    handshake_s = 5.0


Name = Annotated[str, Field(max_length=200)]


class Command(BaseModel):
    """One message of the page; ``id`` comes back with the answer."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    id: int = 0


class Shown(Command):
    """The page has drawn the picture with this number, and is ready for another."""

    do: Literal["shown"]
    number: int


class Want(Command):
    """What the page shows: keys of maps, a light's channel, and whether it compares."""

    do: Literal["want"]
    maps: Annotated[list[Name], Field(max_length=8)] = []
    channel: int | None = None
    pictures_per_s: Annotated[float, Field(gt=0, le=240)] = PAGE.pictures_per_s


class TakeReference(Command):
    """Average the next observations to a new reference."""

    do: Literal["reference"]
    frames: Annotated[int, Field(ge=1, le=100)] = PAGE.reference_frames


class Tare(Command):
    """Subtract the present load."""

    do: Literal["tare"]


class RecordCommand(Command):
    """Begin or end a recording."""

    do: Literal["record"]
    on: bool


class Snapshot(Command):
    """Save the present reading as files."""

    do: Literal["snapshot"]


class Compare(Command):
    """Measure in a second way, by the key of a choice; an empty key ends it."""

    do: Literal["compare"]
    choice: Name = ""


class Play(Command):
    """Change how a recording is played."""

    do: Literal["play"]
    paused: bool | None = None
    loop: bool | None = None
    speed: Annotated[float, Field(ge=0, le=100)] | None = None
    step: bool = False


class MoveCommand(Command):
    """Move the object on a virtual sensor."""

    do: Literal["move"]
    x_mm: float
    y_mm: float
    angle_deg: float
    depth_mm: Annotated[float, Field(ge=0)]
    pressed: bool


class TakeCommand(Command):
    """Take another object in the hand."""

    do: Literal["take"]
    kind: Name
    size_mm: Annotated[float, Field(gt=0, le=100)]


class Calibrate(Command):
    """Begin a guided calibration with a ball, or end it without saving."""

    do: Literal["calibrate"]
    on: bool
    ball_diameter_mm: Annotated[float, Field(ge=0, le=1000)] | None = None
    measured_with: Annotated[str, Field(max_length=200)] = ""


class Finish(Command):
    """Fit the presses of the guided calibration, save the bundle, and measure with it."""

    do: Literal["finish"]


AnyCommand = (
    Shown
    | Want
    | TakeReference
    | Tare
    | RecordCommand
    | Snapshot
    | Compare
    | Play
    | MoveCommand
    | TakeCommand
    | Calibrate
    | Finish
)
_ADAPTER: TypeAdapter[Any] = TypeAdapter(Annotated[AnyCommand, Field(discriminator="do")])


def read_command(message: str | bytes) -> AnyCommand:
    """Return the command of a message.

    Raises
    ------
    InputError
        It is none.
    """
    if isinstance(message, bytes):
        raise InputError("a command is text, not bytes")
    try:
        command: AnyCommand = _ADAPTER.validate_json(message)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(f"the page sent an unknown command: {place}: {first['msg']}") from None
    return command
