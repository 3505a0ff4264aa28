"""``tactile demo``: everything once, with no hardware and no files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.output import say, tell


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("tactile-demo"),
) -> None:
    """Calibrate and measure with virtual rigs; write report.html."""
    from tactile_core.cli.progress import Bar
    from tactile_core.errors import ProfileError
    from tactile_core.evaluation.demo import demonstrate
    from tactile_core.formats.files import write_atomically
    from tactile_core.profiles.loader import list_rigs, load_profile
    from tactile_core.recordings.output_folder import REPORT, OutputFolder
    from tactile_core.views import html

    results = OutputFolder(out)
    results.check([REPORT])
    rows, parts = [], []
    for entry in list_rigs():
        try:
            profile = load_profile(entry.name)
        except ProfileError as error:
            tell(f"skipped {entry.name}: {error}")
            continue
        with Bar() as progress:
            measured, figures = demonstrate(profile, progress)
        rows += measured
        parts += figures
    header = ["rig", "press", "normal error", "height error", "depth", "measured"]
    cells = [
        (
            row.rig,
            row.press,
            f"{row.normal_error_deg:.2f}°",
            f"{1e3 * row.height_error_mm:.0f} µm",
            f"{row.depth_mm:.3f} mm",
            f"{row.measured_depth_mm:.3f} mm",
        )
        for row in rows
    ]
    told = html.paragraph(
        "Every sensor here is virtual, with the mechanics of its gel and the light of its lamps, "
        "so that the truth is known at each pixel. Normal error: mean angle over the contact. "
        "Height error: RMS over the image."
    )
    page = html.page(
        "Optical touch, measured against the truth", [told, html.table(header, cells), *parts]
    )
    report = results.write(REPORT, partial(write_atomically, data=page.encode()))
    for line in [header, *cells]:
        say("  ".join(f"{cell:<26}" if i < 2 else f"{cell:>12}" for i, cell in enumerate(line)))
    tell(f"{report} shows the pictures")
