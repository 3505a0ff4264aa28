"""What one observation gave: quantities by type, steps by name, and what to be wary of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from tactile_core.formats.json import plain
from tactile_core.plugins.blame import blame
from tactile_core.quantities import Frame, Quantity

Q = TypeVar("Q", bound=Quantity)


@dataclass(frozen=True, eq=False)
class Reading:
    """Everything measured from one frame; ``reading[HeightMap].mm`` is typed.

    Attributes
    ----------
    frame : Frame
        What was measured.
    quantities : mapping of type to Quantity
        One per quantity type.
    steps : mapping of step name to Quantity
        The result of each step of the profile's chain.
    latency_ms : float
        Time from the frame to this reading.
    relative : bool
        True when the reference was merely the first frame, so that this tells the change since.
    warnings : tuple of str
        Plain sentences.
    """

    frame: Frame
    quantities: Mapping[type[Quantity], Quantity]
    steps: Mapping[str, Quantity]
    latency_ms: float = 0.0
    relative: bool = False
    warnings: tuple[str, ...] = field(default=())

    @property
    def source(self) -> str:
        """Name of the observation; its sequence number, six digits, when it is live."""
        return self.frame.source or f"{self.frame.sequence:06d}"

    def __getitem__(self, kind: type[Q]) -> Q:
        found = self.get(kind)
        if found is None:
            have = ", ".join(sorted(k.__name__ for k in self.quantities)) or "nothing"
            raise KeyError(
                f"this reading has no {kind.__name__}, only {have}; does the profile name a step "
                f"that gives it, and was a bundle loaded?"
            )
        return found

    def __contains__(self, kind: type[Quantity]) -> bool:
        return kind in self.quantities

    def get(self, kind: type[Q]) -> Q | None:
        """Return the quantity of this type, or None."""
        found = self.quantities.get(kind)
        return found if isinstance(found, kind) else None

    def summary(self) -> dict[str, Any]:
        """One line of strict JSON, as ``tactile run --json`` prints it: None for NaN."""
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
        }
        for quantity in self.quantities.values():
            with blame(f"the quantity {type(quantity).__name__}", quantity):
                line.update(plain(quantity.summary()))
        line["source"] = self.source
        line["warnings"] = list(self.warnings)
        return {key: plain(value) for key, value in line.items()}
