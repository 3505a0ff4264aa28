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


class MessageParts:
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


REFERENCE_FRAMES = 10  # Observations averaged for a reference, as by ``capture_reference``

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
    """What the page shows: keys of maps, and a light's channel."""

    do: Literal["want"]
    maps: Annotated[list[Name], Field(max_length=8)] = []
    channel: int | None = None
    pictures_per_s: Annotated[float, Field(gt=0, le=240)] = 30.0


class TakeReference(Command):
    """Average the next observations to a new reference."""

    do: Literal["reference"]
    frames: Annotated[int, Field(ge=1, le=100)] = REFERENCE_FRAMES


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
