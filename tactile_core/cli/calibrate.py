"""``tactile calibrate``: fit a calibration from presses of something known and write its bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.output import say, say_json, tell


def calibrate(
    profile: Annotated[str, typer.Argument(help="A profile's name or the path of its YAML file.")],
    presses: Annotated[Path, typer.Option(help="Recording of the ball pressed here and there.")],
    reference: Annotated[
        Path | None,
        typer.Option(help="Recording of the untouched sensor; a .tmd target does without."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the bundle; by default the user's data.")
    ] = None,
    ball_diameter_mm: Annotated[float | None, typer.Option(help="Diameter of the ball.")] = None,
    labels: Annotated[
        Path | None, typer.Option(help="CSV of circles that overrule the automatic ones.")
    ] = None,
    target: Annotated[Path | None, typer.Option(help="YAML of a grid of balls, or .tmd.")] = None,
    rows: Annotated[
        str | None, typer.Option(help="A:B, rows of the .tmd target that may be used.")
    ] = None,
    model: Annotated[
        str | None, typer.Option(help="Calibration to fit, plugin.name; else the profile's.")
    ] = None,
    serial: Annotated[str, typer.Option(help="Which physical unit this is.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Fit a calibration, score it on held-out presses and write its bundle."""
    from tactile_core.bundles.bundle import check_place, check_serial, default_place
    from tactile_core.calibration.fitting import calibrate as fit
    from tactile_core.calibration.fitting import inputs_of
    from tactile_core.calibration.height_target import parse_rows
    from tactile_core.cli.progress import Bar
    from tactile_core.profiles.loader import load_profile

    loaded = load_profile(profile)
    if serial:
        check_serial(serial)
    folder = out if out is not None else default_place(loaded, serial or None)
    inputs_of(profile, presses, reference, labels, target).refuse_whole(folder)
    check_place(folder)
    with Bar() as progress:
        result = fit(
            loaded,
            presses,
            reference,
            ball_diameter_mm=ball_diameter_mm,
            labels=labels,
            target=target,
            rows=None if rows is None else parse_rows(rows),
            model=model,
            serial=serial,
            progress=progress,
        )
    result.save(folder)
    for note in result.notes:
        tell(f"note: {note}")
    if as_json:
        say_json(result.summary(folder))
        return
    for press in result.presses:
        if not press.used:
            tell(f"left out {press.file}: {press.why}")
    say(f"{folder}: {result.bundle.manifest.model} on {result.basis}")
    if result.score is not None:
        say(
            f"held-out normal error: mean {result.score.mean_deg:.2f}°, median "
            f"{result.score.median_deg:.2f}°, 90 % {result.score.p90_deg:.2f}° "
            f"(saying 'flat': {result.score.predict_flat_deg:.1f}°)"
        )
