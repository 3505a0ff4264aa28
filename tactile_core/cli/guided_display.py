"""Shows guided calibration: a picture that a terminal redraws, else a line for each change."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from tactile_core.cli.output import print_data, print_json, terminal

if TYPE_CHECKING:
    from tactile_core.calibration.guided.guidance import Guidance

COLUMNS = 48  # Width of the map, characters
SHADES = " .:+#"
"""From nothing covered to all."""
TARGET, IMPRINT = "O", "x"

Show = Callable[["Guidance"], None]


@contextmanager
def shown(size_px: tuple[int, int], *, as_json: bool) -> Iterator[Show]:
    """Yield what shows a guidance.

    Parameters
    ----------
    size_px : (width, height)
        Of the image.
    as_json : bool
        Print an object whenever the advice changes, instead of text.
    """
    screen = terminal()
    if as_json:
        yield _on_change(lambda guidance: print_json(guidance.summary()))
    elif screen is None:
        yield _on_change(lambda guidance: print_data(line(guidance)))
    else:
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        with Live(console=Console(file=screen), auto_refresh=False) as live:
            yield lambda guidance: live.update(Text(page(guidance, size_px)), refresh=True)


def line(guidance: Guidance) -> str:
    """Return the advice, the number of presses and the score in one line."""
    return f"{guidance.say} ({_numbers(guidance)})"


def page(guidance: Guidance, size_px: tuple[int, int]) -> str:
    """Return the advice with a map of the view: shades for what is covered, O where to press."""
    width = COLUMNS
    # a character is about twice as high as wide
    height = max(1, round(COLUMNS / 2 * size_px[1] / size_px[0]))
    rows, columns = guidance.coverage.shape
    y = (np.arange(height) * rows) // height
    x = (np.arange(width) * columns) // width
    level = np.rint(guidance.coverage[np.ix_(y, x)] * (len(SHADES) - 1)).astype(int)
    cells = [[SHADES[value] for value in row] for row in level]
    for place, sign in ((guidance.target_px, TARGET), (guidance.imprint_px, IMPRINT)):
        if place is not None:
            column = int(np.clip(place[0] * width / size_px[0], 0, width - 1))
            row = int(np.clip(place[1] * height / size_px[1], 0, height - 1))
            cells[row][column] = sign
    border = f"+{'-' * width}+"
    drawn = [border, *(f"|{''.join(row)}|" for row in cells), border]
    warning = [f"note: {guidance.warning}"] if guidance.warning else []
    legend = f"{TARGET} press here, {IMPRINT} the imprint, {SHADES[-1]} covered. Ctrl-C to end."
    return "\n".join([guidance.say, *drawn, _numbers(guidance), *warning, legend])


def _numbers(guidance: Guidance) -> str:
    score = "no score yet" if guidance.held_out is None else f"normals {guidance.held_out:.2f}°"
    covered = float((guidance.coverage >= 1).mean())
    slopes = float(guidance.slope_coverage.mean())
    return f"{guidance.kept} kept, surface {covered:.0%}, slopes {slopes:.0%}, {score}"


def _on_change(show: Show) -> Show:
    """Call ``show`` only for advice that differs from the one before."""
    last: list[tuple[object, ...]] = [()]

    def changed(guidance: Guidance) -> None:
        now = guidance.say, guidance.kept, guidance.held_out, guidance.warning
        if now != last[0]:
            last[0] = now
            show(guidance)

    return changed
