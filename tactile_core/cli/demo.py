"""``tactile demo``: calibrates and measures with virtual sensors, without hardware or files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.output import print_data, print_message

_UNRESOLVED = "*: the camera does not resolve the tip of this object, so its ratio is below 1."


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("tactile-demo"),
) -> None:
    """Calibrate every shipped sensor virtually, measure presses and write report.html."""
    from tactile_core.cli.output import Bar
    from tactile_core.errors import ProfileError
    from tactile_core.evaluation.demo import demonstrate_rigs
    from tactile_core.formats.files import write_atomically
    from tactile_core.pipeline.workers import available_cores
    from tactile_core.profiles.loader import list_rigs, load_profile
    from tactile_core.recordings.output_folder import REPORT, OutputFolder
    from tactile_core.views import html

    results = OutputFolder(out)
    results.check([REPORT])
    profiles = []
    for entry in list_rigs():
        try:
            profiles.append(load_profile(entry.name))
        except ProfileError as error:
            print_message(f"skipped {entry.name}: {error}")
    with Bar() as progress:
        found = demonstrate_rigs(profiles, progress, processes=available_cores())
    rows = [row for measured, _ in found for row in measured]
    parts = [part for _, figures in found for part in figures]
    header = ["rig", "press", "normal error", "height error", "depth", "measured", "ratio"]
    cells = [
        (
            row.rig,
            row.press,
            f"{row.normal_error_deg:.2f}°",
            f"{1e3 * row.height_error_mm:.0f} µm",
            f"{row.depth_mm:.3f} mm",
            f"{row.measured_depth_mm:.3f} mm",
            f"{row.depth_ratio:.3f}{'' if row.resolved else '*'}",
        )
        for row in rows
    ]
    introduction = html.paragraph(
        "Every sensor here is virtual: its gel mechanics and its illumination are simulated, so "
        "the ground truth is known at each pixel. Normal error: mean angle over the contact area. "
        "Height error: RMS over the image. Depth: peak of the height map; ratio: measured depth "
        f"over true depth. {_UNRESOLVED}"
    )
    page = html.page(
        "Tactile measurements compared with ground truth",
        [introduction, html.table(header, cells), *parts],
    )
    report = results.write(REPORT, partial(write_atomically, data=page.encode()))
    for line in [header, *cells]:
        print_data(
            "  ".join(f"{cell:<26}" if i < 2 else f"{cell:>12}" for i, cell in enumerate(line))
        )
    if any(not row.resolved for row in rows):
        print_message(_UNRESOLVED)
    print_message(f"{report} shows the pictures")
