"""One row of the table of accuracy."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Row:
    """A figure, what it was measured on, and what knowing nothing would have scored.

    Attributes
    ----------
    name : str
        For ``--only``.
    figure : str
        What is measured, with its unit.
    recordings : str
    count : str
        How many presses, balls, lifts or frames.
    sample : str
        In what sense the recordings were not seen before.
    values : dict of str to float
        By direction, or by part; ``value`` is the worst of them.
    value : float
    control : dict of str to float
        The same figure of what knows nothing of the surface or of slip.
    also : dict of str to float
        Further figures.
    command : str
    """

    name: str
    figure: str
    recordings: str
    count: str
    sample: str
    values: dict[str, float]
    value: float
    control: dict[str, float]
    command: str
    also: dict[str, float] = field(default_factory=dict)

    def summary(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    def line(self) -> str:
        """For a markdown table."""
        cells = (
            self.name,
            self.figure,
            self.recordings,
            self.count,
            self.sample,
            _said(self.values),
            f"**{self.value:.3g}**",
            _said(self.control),
            _said(self.also),
            f"`{self.command}`",
        )
        return f"| {' | '.join(cells)} |"


HEADER = (
    "| row | figure | recordings | how many | sample | measured | worst | control | also |"
    " command |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def command(name: str) -> str:
    """How to measure this row alone."""
    return f"python benchmarks/accuracy.py --only {name}"


def _said(values: dict[str, float]) -> str:
    return "; ".join(f"{key}: {value:.3g}" for key, value in values.items()) or "–"
