"""One row of the table of accuracy."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Row:
    """A figure of accuracy, its recordings, and the score of a trivial baseline.

    Attributes
    ----------
    name : str
        Name for ``--only``.
    figure : str
        Quantity and unit.
    recordings : str
    count : str
        Number of presses, balls, lifts or frames.
    sample : str
        In what sense the recordings are out of sample.
    values : dict of str to float
        By direction of the split, or by part.
    value : float
        Worst of the values.
    control : dict of str to float
        The same figure of a baseline without any measurement of surface or slip.
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
        """JSON-ready."""
        return asdict(self)

    def line(self) -> str:
        """Row of a Markdown table."""
        cells = (
            self.name,
            self.figure,
            self.recordings,
            self.count,
            self.sample,
            _formatted(self.values),
            f"**{self.value:.3g}**",
            _formatted(self.control),
            _formatted(self.also),
            f"`{self.command}`",
        )
        return f"| {' | '.join(cells)} |"


HEADER = (
    "| row | figure | recordings | how many | sample | measured | worst | control | also |"
    " command |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def command(name: str) -> str:
    """Command that measures this row alone."""
    return f"python benchmarks/accuracy.py --only {name}"


def _formatted(values: dict[str, float]) -> str:
    return "; ".join(f"{key}: {value:.3g}" for key, value in values.items()) or "–"
