"""``tactile bench``: the cost of each stage on this machine."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import print_data, print_json, print_message

if TYPE_CHECKING:
    from tactile_core.evaluation.timing import Bench, Benches
    from tactile_core.profiles.model import Profile

_SMALLEST_PX = 64  # Shortest image side that `--size` accepts, px

_LARGEST_PX = 4096  # Longest image side that `--size` accepts, px


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
    from tactile_core.evaluation.timing import bench as measure_all

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
    if not all(_SMALLEST_PX <= side <= _LARGEST_PX for side in sides):
        raise InputError(
            f"--size {words}: write WIDTHxHEIGHT, for example 640x480; each side from "
            f"{_SMALLEST_PX} to {_LARGEST_PX}"
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
