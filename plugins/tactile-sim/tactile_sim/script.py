"""Scripts of a virtual stage: YAML files that list the moves of an object."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    model_validator,
)

from tactile_core.errors import InputError, Problem
from tactile_core.formats.yaml_tree import problem_at, read_yaml
from tactile_core.profiles.problems import problems_of
from tactile_sim.indenters import make_indenter
from tactile_sim.stage import VirtualStage

# Number of frames of one step; a million are nine hours at 30 Hz.
Frames = Annotated[PositiveInt, Field(le=1_000_000)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Indent(_Part):
    """Lower or raise the object."""

    depth_mm: NonNegativeFloat | None = Field(
        default=None, description="Target depth below first contact, mm; or give force_n."
    )
    force_n: PositiveFloat | None = Field(
        default=None, description="Target normal force, N; or give depth_mm."
    )
    frames: Frames = Field(default=5, description="Number of frames during the move.")
    seconds: PositiveFloat | None = Field(
        default=None, description="Duration, s. Default: quasi-static."
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if (self.depth_mm is None) == (self.force_n is None):
            raise ValueError("give depth_mm or force_n")
        return self

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step, one frame at a time."""
        if self.depth_mm is not None:
            stage.gel.check_depth(self.depth_mm)
        start_mm, start_n = stage.depth_mm, stage.force_n
        for part in range(1, self.frames + 1):
            share = part / self.frames
            seconds = None if self.seconds is None else self.seconds / self.frames
            if self.depth_mm is not None:
                depth_mm = start_mm + share * (self.depth_mm - start_mm)
                stage.press(depth_mm=depth_mm, seconds=seconds)
            elif self.force_n is not None:
                force_n = start_n + share * (self.force_n - start_n)
                stage.press(force_n=force_n, seconds=seconds)
            yield


class Shear(_Part):
    """Move the object tangentially."""

    dx_mm: float = Field(default=0.0, description="Displacement along x (right), mm.")
    dy_mm: float = Field(default=0.0, description="Displacement along y (down), mm.")
    frames: Frames = Field(default=10, description="Number of frames during the move.")
    seconds: PositiveFloat | None = Field(
        default=None, description="Duration, s. Default: quasi-static."
    )

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step, one frame at a time."""
        return _in_parts(stage.shear, self.frames, self.seconds, self.dx_mm, self.dy_mm)


class Roll(Shear):
    """Roll the object."""

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step, one frame at a time."""
        return _in_parts(stage.roll, self.frames, self.seconds, self.dx_mm, self.dy_mm)


class Twist(_Part):
    """Rotate the object about its origin."""

    degrees: float = Field(description="Angle, positive from x towards y.")
    frames: Frames = Field(default=10, description="Number of frames during the move.")
    seconds: PositiveFloat | None = Field(
        default=None, description="Duration, s. Default: quasi-static."
    )

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step, one frame at a time."""
        return _in_parts(stage.twist, self.frames, self.seconds, self.degrees)


class Lift(_Part):
    """Lift a heavy object from a table: friction carries its weight, or it slips.

    The table carries the object until the shear force of the gel does. An object that friction
    cannot carry stays on the table, or falls back on it.
    """

    weight_n: PositiveFloat = Field(description="Weight that the gel has to carry, N.")
    height_mm: PositiveFloat = Field(description="Height of the lift, mm.")
    down_deg: float = Field(
        default=90.0, description="Direction of gravity in the image, from x towards y."
    )
    frames: Frames = Field(default=15, description="Number of frames during the lift.")
    seconds: PositiveFloat | None = Field(
        default=None, description="Duration, s. Default: quasi-static."
    )
    shake: NonNegativeFloat = Field(
        default=0.0,
        description="Vibration of the gripper: standard deviation of its acceleration, relative "
        "to gravity.",
    )

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step, one frame at a time."""
        down = np.radians(self.down_deg)
        gravity = np.array([np.cos(down), np.sin(down)])
        duration = None if self.seconds is None else self.seconds / self.frames
        start = stage.state.pose
        rng = np.random.default_rng(81)  # The same script gives the same moves
        for part in range(1, self.frames + 1):
            # the lighter moments of a vibration do not push the object up
            # [weights] A pull needs a direction
            load = max(1 + self.shake * float(rng.standard_normal()), 0.1)
            now = stage.state.pose
            travel = float(
                (now.x_mm - start.x_mm) * gravity[0] + (now.y_mm - start.y_mm) * gravity[1]
            )
            height_mm = self.height_mm * part / self.frames
            stage.pull(
                *(load * self.weight_n * gravity),
                at_most_mm=max(height_mm - travel, 0.0),
                seconds=duration,
            )
            yield


class Hold(_Part):
    """Let time pass at constant pose and load."""

    seconds: PositiveFloat = Field(description="Duration, s.")
    frames: Frames = Field(default=5, description="Number of frames during the hold.")

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step, one frame at a time."""
        for _ in range(self.frames):
            stage.hold(self.seconds / self.frames)
            yield


class Release(_Part):
    """Remove the object."""

    seconds: NonNegativeFloat | None = Field(
        default=None, description="Recovery time of the gel, s. Default: full recovery."
    )

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step; it has one frame."""
        stage.release(self.seconds)
        yield


class Take(BaseModel):
    """Select the object for the next press; further keys are its sizes."""

    model_config = ConfigDict(extra="allow", frozen=True)

    kind: str = Field(description="sphere, cylinder, flat, cone, heightmap, mesh, coin, …")
    x_mm: float = Field(default=0.0, description="Position relative to the image centre, mm.")
    y_mm: float = Field(default=0.0, description="Position relative to the image centre, mm.")
    angle_deg: float = Field(default=0.0, description="Rotation, positive from x towards y.")

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the step; it has no frame."""
        pose = {"x_mm": self.x_mm, "y_mm": self.y_mm, "angle_deg": self.angle_deg}
        stage.indenter(self.kind, **pose, **self.sizes)
        yield from ()

    @property
    def sizes(self) -> dict[str, Any]:
        """Options of the indenter's kind."""
        return dict(self.model_extra or {})


class ScriptStep(_Part):
    """One step of a script: exactly one of these keys."""

    indenter: Take | None = Field(default=None, description="Select an object.")
    press: Indent | None = Field(default=None, description="Lower or raise the object.")
    shear: Shear | None = Field(default=None, description="Move the object tangentially.")
    twist: Twist | None = Field(default=None, description="Rotate the object.")
    roll: Roll | None = Field(default=None, description="Roll the object.")
    lift: Lift | None = Field(default=None, description="Lift a heavy object.")
    hold: Hold | None = Field(default=None, description="Let time pass.")
    release: Release | None = Field(default=None, description="Remove the object.")

    @model_validator(mode="after")
    def _one_thing(self) -> Self:
        if len(self.model_fields_set) != 1 or self.action is None:
            raise ValueError(f"a step is one of {', '.join(type(self).model_fields)}")
        return self

    @property
    def action(self) -> Any:
        """The step's action."""
        return getattr(self, next(iter(self.model_fields_set)))


class _Contents(_Part):
    steps: tuple[ScriptStep, ...] = Field(min_length=1, description="Steps in order.")
    skip: NonNegativeInt = Field(
        default=0, description="Frames to leave out at the start, for example until contact."
    )
    every: PositiveInt = Field(default=1, description="Keep every n-th frame of the rest.")


class Script:
    """Sequence of steps read from a YAML file.

    Parameters
    ----------
    path : Path
        The YAML file. Mesh paths in it are relative to its folder.

    Raises
    ------
    InputError
        The file does not exist or has mistakes; each is listed with line, column and key.
    """

    def __init__(self, path: Path) -> None:
        if not Path(path).is_file():
            raise InputError(f"there is no script {path}; it is a YAML file of steps")
        self._tree, problems = read_yaml(path)
        try:
            contents = _Contents.model_validate(self._tree.plain())
        except ValidationError as error:
            raise _refusal(problems + problems_of(error, self._tree, _Contents)) from None
        self.skip, self.every = contents.skip, contents.every
        self.steps = tuple(_in_folder(step, Path(path).parent) for step in contents.steps)
        problems += self._impossible_objects()
        if self.frames == 0:
            message = f"leaves no frame of {self._played}; skip fewer"
            problems.append(problem_at(self._tree.origin(("skip",)), ("skip",), message))
        if problems:
            raise _refusal(problems)

    @property
    def frames(self) -> int:
        """Number of frames that are kept; the first of all is of the undeformed sensor."""
        return max(0, -(-(self._played - self.skip) // self.every))

    @property
    def _played(self) -> int:
        return 1 + sum(_frames_of(step) for step in self.steps)

    def _impossible_objects(self) -> list[Problem]:
        problems = []
        for number, step in enumerate(self.steps):
            if isinstance(step.action, Take):
                try:
                    make_indenter(step.action.kind, **step.action.sizes)
                except InputError as error:
                    keys = ("steps", number, "indenter")
                    problems.append(problem_at(self._tree.origin(keys), keys, str(error)))
        return problems

    def play_frames(self, stage: VirtualStage) -> Iterator[None]:
        """Play the steps in order; yield whenever a frame is to be taken.

        Raises
        ------
        InputError
            A step is impossible; the message starts with its location in the file.
        """
        yield from islice(self._all_played(stage), self.skip, None, self.every)

    def _all_played(self, stage: VirtualStage) -> Iterator[None]:
        yield
        for number, step in enumerate(self.steps):
            try:
                yield from step.action.play_frames(stage)
            except InputError as error:
                location = self._tree.origin(("steps", number, *step.model_fields_set))
                raise InputError(f"{location}: {error}") from error


def _in_parts(
    move: Callable[..., None], frames: int, seconds: float | None, *amounts: float
) -> Iterator[None]:
    for _ in range(frames):
        duration = None if seconds is None else seconds / frames
        move(*(amount / frames for amount in amounts), seconds=duration)
        yield


def _frames_of(step: ScriptStep) -> int:
    if isinstance(step.action, Take):
        return 0
    return int(getattr(step.action, "frames", 1))


def _in_folder(step: ScriptStep, folder: Path) -> ScriptStep:
    """Return the step with a mesh's path resolved relative to the script's folder."""
    take = step.action
    if not isinstance(take, Take) or not isinstance(take.sizes.get("path"), str):
        return step
    sizes = take.sizes | {"path": folder / take.sizes["path"]}
    return ScriptStep(indenter=Take.model_validate(take.model_dump() | sizes))


def _refusal(problems: list[Problem]) -> InputError:
    lines = "\n".join(sorted(map(str, problems)))
    head = "" if len(problems) == 1 else f"there are {len(problems)} mistakes in the script:\n"
    return InputError(head + lines)
