"""What happens on a virtual stage, as a YAML file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    model_validator,
)

from tactile_core.errors import InputError, Problem
from tactile_core.profiles.nodes import problem_at
from tactile_core.profiles.problems import problems_of
from tactile_core.profiles.yaml_tree import read_yaml
from tactile_core.sim.indenters import make_indenter
from tactile_core.sim.stage import VirtualStage


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Indent(_Part):
    """Lower or raise the object."""

    depth_mm: NonNegativeFloat | None = Field(default=None, description="To this depth, or …")
    force_n: PositiveFloat | None = Field(default=None, description="… to this force.")
    frames: PositiveInt = Field(default=5, description="Frames on the way.")

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if (self.depth_mm is None) == (self.force_n is None):
            raise ValueError("give depth_mm or force_n")
        return self

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it in as many parts as there are frames."""
        if self.depth_mm is not None:
            stage.gel.check_depth(self.depth_mm)
        start_mm, start_n = stage.depth_mm, stage.force_n
        for part in range(1, self.frames + 1):
            share = part / self.frames
            if self.depth_mm is not None:
                stage.press(depth_mm=start_mm + share * (self.depth_mm - start_mm))
            elif self.force_n is not None:
                stage.press(force_n=start_n + share * (self.force_n - start_n))
            yield


class Shear(_Part):
    """Move the object along the skin."""

    dx_mm: float = Field(default=0.0, description="Along x, to the right.")
    dy_mm: float = Field(default=0.0, description="Along y, down.")
    frames: PositiveInt = Field(default=10, description="Frames on the way.")
    seconds: PositiveFloat | None = Field(default=None, description="How long it takes.")

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it in as many parts as there are frames."""
        return _in_parts(stage.shear, self.frames, self.seconds, self.dx_mm, self.dy_mm)


class Roll(Shear):
    """Roll the object."""

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it in as many parts as there are frames."""
        return _in_parts(stage.roll, self.frames, self.seconds, self.dx_mm, self.dy_mm)


class Twist(_Part):
    """Turn the object."""

    degrees: float = Field(description="From x towards y.")
    frames: PositiveInt = Field(default=10, description="Frames on the way.")
    seconds: PositiveFloat | None = Field(default=None, description="How long it takes.")

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it in as many parts as there are frames."""
        return _in_parts(stage.twist, self.frames, self.seconds, self.degrees)


class Hold(_Part):
    """Let time pass."""

    seconds: PositiveFloat = Field(description="How long.")
    frames: PositiveInt = Field(default=5, description="Frames meanwhile.")

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it in as many parts as there are frames."""
        for _ in range(self.frames):
            stage.hold(self.seconds / self.frames)
            yield


class Release(_Part):
    """Take the object away."""

    seconds: NonNegativeFloat | None = Field(
        default=None, description="How long the skin recovers; by default, fully."
    )

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it; one frame."""
        stage.release(self.seconds)
        yield


class Take(BaseModel):
    """Choose the object that is pressed next; further keys are its sizes."""

    model_config = ConfigDict(extra="allow", frozen=True)

    kind: str = Field(description="sphere, cylinder, flat, cone, heightmap, mesh, coin, …")
    x_mm: float = Field(default=0.0, description="Place, from the image centre.")
    y_mm: float = Field(default=0.0, description="Place, from the image centre.")
    angle_deg: float = Field(default=0.0, description="Turn, from x towards y.")

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do it; no frame."""
        place = {"x_mm": self.x_mm, "y_mm": self.y_mm, "angle_deg": self.angle_deg}
        stage.indenter(self.kind, **place, **self.sizes)
        yield from ()

    @property
    def sizes(self) -> dict[str, Any]:
        """The further keys."""
        return dict(self.model_extra or {})


class ScriptStep(_Part):
    """One thing that happens."""

    indenter: Take | None = Field(default=None, description="Choose an object.")
    press: Indent | None = Field(default=None, description="Lower or raise it.")
    shear: Shear | None = Field(default=None, description="Move it along the skin.")
    twist: Twist | None = Field(default=None, description="Turn it.")
    roll: Roll | None = Field(default=None, description="Roll it.")
    hold: Hold | None = Field(default=None, description="Let time pass.")
    release: Release | None = Field(default=None, description="Take it away.")

    @model_validator(mode="after")
    def _one_thing(self) -> Self:
        if len(self.model_fields_set) != 1 or self.action is None:
            raise ValueError(f"a step is one of {', '.join(type(self).model_fields)}")
        return self

    @property
    def action(self) -> Any:
        """What is done."""
        return getattr(self, next(iter(self.model_fields_set)))


class _Contents(_Part):
    steps: tuple[ScriptStep, ...] = Field(min_length=1, description="What happens, in order.")


class Script:
    """What happens, step after step, with the place of each step in the file.

    Parameters
    ----------
    path : Path
        The YAML file; paths of meshes in it are relative to its folder.

    Raises
    ------
    InputError
        There is no such file, or there are mistakes in it: every one with line, column and key.
    """

    def __init__(self, path: Path) -> None:
        if not Path(path).is_file():
            raise InputError(f"there is no script {path}; it is a YAML file of steps")
        self._tree, problems = read_yaml(path)
        try:
            contents = _Contents.model_validate(self._tree.plain())
        except ValidationError as error:
            raise _refusal(problems + problems_of(error, self._tree, _Contents)) from None
        self.steps = tuple(_beside(step, Path(path).parent) for step in contents.steps)
        problems += self._impossible_objects()
        if problems:
            raise _refusal(problems)

    @property
    def frames(self) -> int:
        """How many frames playing it gives, the untouched sensor first."""
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

    def played(self, stage: VirtualStage) -> Iterator[None]:
        """Do one step after another; each time, a frame may be taken.

        Raises
        ------
        InputError
            A step is impossible, with its place in the file.
        """
        yield
        for number, step in enumerate(self.steps):
            try:
                yield from step.action.played(stage)
            except InputError as error:
                place = self._tree.origin(("steps", number, *step.model_fields_set))
                raise InputError(f"{place}: {error}") from error


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


def _beside(step: ScriptStep, folder: Path) -> ScriptStep:
    """Return the step with a mesh's path taken from the script's folder."""
    take = step.action
    if not isinstance(take, Take) or not isinstance(take.sizes.get("path"), str):
        return step
    sizes = take.sizes | {"path": folder / take.sizes["path"]}
    return ScriptStep(indenter=Take.model_validate(take.model_dump() | sizes))


def _refusal(problems: list[Problem]) -> InputError:
    lines = "\n".join(sorted(map(str, problems)))
    head = "" if len(problems) == 1 else f"there are {len(problems)} mistakes in the script:\n"
    return InputError(head + lines)
