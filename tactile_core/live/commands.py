"""What a page can ask for, checked before anything is done."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from tactile_core.errors import InputError
from tactile_core.live.parameters import PAGE

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


class Record(Command):
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


class Move(Command):
    """Move the object on a virtual sensor."""

    do: Literal["move"]
    x_mm: float
    y_mm: float
    angle_deg: float
    depth_mm: Annotated[float, Field(ge=0)]
    pressed: bool


class Take(Command):
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
    | Record
    | Snapshot
    | Compare
    | Play
    | Move
    | Take
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
