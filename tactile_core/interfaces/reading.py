"""The result of one observation: quantities by type, steps by name, and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar, overload

from tactile_core.formats.json import plain
from tactile_core.quantities import Frame, Quantity
from tactile_core.quantities.quantity import Guard, pass_errors

Q = TypeVar("Q", bound=Quantity)


@dataclass(frozen=True, eq=False)
class Reading:
    """Everything measured from one frame; ``reading[HeightMap].mm`` is typed.

    ``reading["height"]`` is the result of the profile's step of that name.

    Attributes
    ----------
    frame : Frame
        The measured frame.
    quantities : mapping of type to Quantity
        One quantity of each type.
    steps : mapping of step name to Quantity
        The result of each step of the profile's chain.
    inputs : mapping of type to Quantity
        External inputs that came with the frame, such as a robot's pose.
    latency_ms : float
        Time from the frame to this reading.
    relative : bool
        True if the reference is the session's first frame, so that all values are changes since.
    warnings : tuple of str
        Complete sentences.
    """

    frame: Frame
    quantities: Mapping[type[Quantity], Quantity]
    steps: Mapping[str, Quantity]
    inputs: Mapping[type[Quantity], Quantity] = field(default_factory=dict)
    latency_ms: float = 0.0
    relative: bool = False
    warnings: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        head = f"Reading of {self.source} at {self.frame.timestamp_s:.3f} s"
        warned = [f"warning: {sentence}" for sentence in self.warnings]
        return "\n  ".join([head, *map(repr, self.quantities.values()), *warned])

    @property
    def source(self) -> str:
        """Name of the observation; if it is live, its sequence number in six digits."""
        return self.frame.name

    @overload
    def __getitem__(self, wanted: type[Q]) -> Q: ...
    @overload
    def __getitem__(self, wanted: str) -> Quantity: ...
    def __getitem__(self, wanted: type[Q] | str) -> Q | Quantity:
        found = self.get(wanted)
        if found is None:
            by_step = isinstance(wanted, str)
            there = self.steps if by_step else [kind.__name__ for kind in self.quantities]
            name = f"step {wanted!r}" if isinstance(wanted, str) else wanted.__name__
            raise KeyError(
                f"this reading has no {name}, only {', '.join(sorted(there)) or 'nothing'}; does "
                f"the profile name a step that gives it, and was a bundle loaded?"
            )
        return found

    def __contains__(self, wanted: type[Quantity] | str) -> bool:
        return wanted in (self.steps if isinstance(wanted, str) else self.quantities)

    @overload
    def get(self, wanted: type[Q]) -> Q | None: ...
    @overload
    def get(self, wanted: str) -> Quantity | None: ...
    def get(self, wanted: type[Q] | str) -> Q | Quantity | None:
        """Return the quantity of this type, or of the step of this name, or None."""
        if isinstance(wanted, str):
            return self.steps.get(wanted)
        found = self.quantities.get(wanted)
        return found if isinstance(found, wanted) else None

    def summary(self, guard: Guard = pass_errors) -> dict[str, Any]:
        """Return the line of ``tactile run --json`` as a dict: strict JSON, with None for NaN.

        Parameters
        ----------
        guard : callable, optional
            Returns a context manager for the code of one quantity; it names the quantity's plugin
            if that code fails.
        """
        line: dict[str, Any] = {
            "sequence": self.frame.sequence,
            "timestamp_s": self.frame.timestamp_s,
            "source": self.source,
            "latency_ms": round(self.latency_ms, 3),
            "relative": self.relative,
            "contact_area_mm2": None,
            "max_height_mm": None,
            "wrench": None,
            "slip": None,
            "markers": None,
            "load": None,
            "shows": None,
        }
        for quantity in self.quantities.values():
            with guard(quantity):
                for key, value in plain(quantity.summary()).items():
                    entry = line.get(key)
                    both = isinstance(entry, dict) and isinstance(value, dict)
                    line[key] = entry | value if both else value
        line["source"] = self.source
        line["warnings"] = list(self.warnings)
        return {key: plain(value) for key, value in line.items()}

    def _repr_html_(self) -> str:
        """Return a picture and a table of numbers, which notebooks show."""
        from tactile_core.views.html import notebook_html

        clean = [quantity.finite() for quantity in self.quantities.values()]
        layers = [layer for quantity in clean for layer in quantity.layers()]
        return notebook_html(self.frame, layers, self.summary(), self.warnings)
