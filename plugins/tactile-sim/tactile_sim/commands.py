"""The commands of virtual sensors: ``tactile demo``, ``simulate`` and ``bench``."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactile_core.cli.options import AsJson, ProfileName
from tactile_core.cli.output import print_data, print_json, print_message

if TYPE_CHECKING:
    from tactile_core.profiles.model import Profile
    from tactile_sim.timing import Bench, Benches

_UNRESOLVED = "*: the camera does not resolve the tip of this object, so its ratio is below 1."

_SIDES_PX = range(64, 4097)  # image sides that ``--size`` accepts


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("tactile-demo"),
) -> None:
    """Calibrate every shipped sensor virtually, measure presses and write report.html."""
    from tactile_core.cli.output import Bar
    from tactile_core.errors import ProfileError
    from tactile_core.formats.files import write_atomically
    from tactile_core.pipeline.workers import available_cores
    from tactile_core.profiles.loader import list_rigs, load_profile
    from tactile_core.recordings.output_folder import REPORT, OutputFolder
    from tactile_core.views import html
    from tactile_sim.demonstration import demonstrate_rigs

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


def simulate(
    profile: ProfileName,
    script: Annotated[Path, typer.Option(help="YAML of the indenter and its motion.")],
    out: Annotated[Path, typer.Option(help="Folder for frames, reference and ground truth.")],
    seed: Annotated[
        int, typer.Option(min=0, help="Random seed of the unit's variations and its noise.")
    ] = 0,
    unit: Annotated[
        int | None,
        typer.Option(min=0, help="Another unit of the design, by its number. Default: the design."),
    ] = None,
    mode: Annotated[str, typer.Option(help="accurate, or fast for real time.")] = "accurate",
    as_json: AsJson = False,
) -> None:
    """Write the frames of a virtual sensor for a script, with the ground truth.

    Measure them with 'tactile run PROFILE --input OUT/frames --reference OUT/reference' and score
    the result with 'tactile compare … --truth OUT/truth'.
    """
    from tactile_core.cli.output import Bar
    from tactile_core.errors import InputError
    from tactile_core.profiles.loader import load_profile
    from tactile_sim.script import Script
    from tactile_sim.simulation import simulate as play
    from tactile_sim.stage import VirtualStage, vary

    if mode not in ("accurate", "fast"):
        raise InputError(f"--mode is 'accurate' or 'fast', not {mode!r}")
    steps = Script(script)
    design = load_profile(profile, sim=True)
    sensor = design if unit is None else vary(design, unit)
    stage = VirtualStage(sensor, seed, "fast" if mode == "fast" else "accurate")
    with Bar() as progress:
        count = play(stage, steps, out, progress=progress)
    if as_json:
        print_json({"out": str(out), "frames": count, "profile": stage.profile.name})
        return
    print_data(f"{out}: {count} frames of {stage.profile.name}, each with its ground truth")


def starting_calibration(
    profile: ProfileName,
    out: Annotated[Path, typer.Option(help="Folder for the bundle.")],
    units: Annotated[int, typer.Option(min=5, help="Number of virtual units.")] = 15,
    presses: Annotated[
        Path | None, typer.Option(help="Presses of a ball on a real unit, to add to them.")
    ] = None,
    reference: Annotated[
        Path | None, typer.Option(help="Recording of that unit with no contact.")
    ] = None,
    ball_diameter_mm: Annotated[float | None, typer.Option(help="Its ball, mm.")] = None,
    as_json: AsJson = False,
) -> None:
    """Fit a bundle that measures every unit of a design coarsely, to ship with its profile.

    Name its folder in the profile as 'starting_bundle'.
    """
    from tactile_core.calibration.fitting import calibrate
    from tactile_core.cli.output import Bar
    from tactile_core.errors import InputError
    from tactile_sim.starting_calibration import check_starting_place
    from tactile_sim.starting_calibration import starting_calibration as fit

    check_starting_place(out)
    if presses is None and (reference is not None or ball_diameter_mm is not None):
        raise InputError("--reference and --ball-diameter-mm are of real presses; give --presses")
    measured = None
    if presses is not None:
        measured = calibrate(
            profile, presses, reference, ball_diameter_mm=ball_diameter_mm, scored=False
        )
    with Bar() as progress:
        made = fit(profile, units=units, measured=measured, progress=progress)
    made.save(out)
    if as_json:
        print_json({"out": str(out), "held_out": made.score.summary()})
        return
    print_data(f"{out}: {made.describe()}")


def bench(
    profile: Annotated[
        str | None, typer.Argument(help="A profile's name or YAML file; default: all profiles.")
    ] = None,
    size: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WIDTHxHEIGHT",
            help="Image size in px, for example 640x480; repeat it for more sizes. Default: the "
            "size in each profile.",
        ),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Calibration model, for example core.lookup_table. Default: the model in each "
            "profile.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure the time and memory of each processing stage on one core of this machine.

    The frames come from virtual sensors, calibrated on rendered presses. The time of a camera
    driver is not included. Takes under a minute unless you ask for several sizes.
    """
    from tactile_core.cli.output import Bar
    from tactile_sim.timing import bench as measure_all

    sizes_px = [_size(words) for words in size or []]
    profiles, unusable = _profiles(profile)
    with Bar() as progress:
        result = measure_all(
            profiles, sizes_px=sizes_px, calibration=calibration, progress=progress
        )
    for line in (*unusable, *result.left_out):
        print_message(f"left out {line}")
    if as_json:
        print_json(result.summary())
        return
    for line in _lines(result):
        print_data(line)


def _profiles(name: str | None) -> tuple[list[Profile], list[str]]:
    from tactile_core.errors import TactileError
    from tactile_core.profiles.loader import list_profiles, load_profile

    if name is not None:
        return [load_profile(name)], []
    loaded, unusable = [], []
    for entry in list_profiles():
        try:
            loaded.append(load_profile(entry.name))
        except TactileError as error:
            unusable.append(f"{entry.name}: {error}")
    return loaded, unusable


def _size(words: str) -> tuple[int, int]:
    from tactile_core.errors import InputError

    found = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", words)
    sides = (int(found[1]), int(found[2])) if found else (0, 0)
    if not all(side in _SIDES_PX for side in sides):
        raise InputError(
            f"--size {words}: write WIDTHxHEIGHT, for example 640x480; each side from "
            f"{_SIDES_PX[0]} to {_SIDES_PX[-1]}"
        )
    return sides


def _lines(result: Benches) -> list[str]:
    from tactile_core.cli.output import table_lines

    about = result.machine
    versions = ", ".join(f"{name} {v}" for name, v in about["versions"].items())
    lines = [
        f"{about['cpu']}, {about['cores']} cores, {about['system']}; {versions}",
        "one core, one thread, no camera; times in ms; memory of a whole process that only streams",
    ]
    for one in result.benches:
        rows = [
            [c.stage, f"{c.median_ms:.3f}", f"{c.p90_ms:.3f}", f"{c.per_second:.0f}"]
            for c in one.stages
        ]
        lines += ["", _title(one), *table_lines(["stage", "median", "p90", "fps"], rows)]
    return lines


def _title(one: Bench) -> str:
    width, height = one.size_px
    parts = [f"{one.profile}, {width} × {height}, {one.model}"]
    if one.peak_memory_mib is not None:
        parts.append(f"{one.peak_memory_mib:.0f} MiB")
    return "; ".join(parts)
