"""Sections of a bundle: what a calibration has fitted, and how it is stored."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, field_validator

from tactile_core.formats.text import shorten_repr

MOST = 1e9  # Largest magnitude of any number in a profile, in any unit


class Section(BaseModel):
    """A mapping whose unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _plausible_magnitude(cls, value: Any) -> Any:
        # larger numbers could overflow in later arithmetic
        if _largest(value) > MOST:
            raise ValueError(f"should be at most {MOST:g}, not {shorten_repr(value)}")
        return value

    @field_validator("*", mode="before")
    @classmethod
    def _no_switch(cls, value: Any) -> Any:
        # no key of a section is a switch, and pydantic would accept true as 1
        if isinstance(value, bool):
            raise ValueError(f"should not be {str(value).lower()}; there is nothing to switch here")
        return value


def _largest(value: Any) -> float:
    """Return the largest magnitude among finite numbers, including those in nested lists."""
    if isinstance(value, list | tuple):
        return max(map(_largest, value), default=0.0)
    if isinstance(value, int | float) and value - value == 0:
        return abs(value)
    return 0.0


class Artefact(ABC):
    """An immutable fitted value that belongs to one unit.

    A bundle stores each artefact in its own folder under the class name that the hook
    ``tactile_artefacts`` registers.

    Attributes
    ----------
    noun, command : str
        What it is, and the command of ``tactile`` that fits it, for messages.
    """

    noun: ClassVar[str] = "model"
    command: ClassVar[str] = "calibrate"

    @abstractmethod
    def save(self, directory: Path) -> None:
        """Write the artefact's files into an existing, empty directory, without pickles."""

    @classmethod
    @abstractmethod
    def load(cls, directory: Path) -> Self:
        """Read what :meth:`save` wrote.

        Raises
        ------
        CalibrationError
            The files are missing, damaged or from a newer version.
        """
