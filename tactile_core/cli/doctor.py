"""``tactile doctor``: examines the installation and a sensor, or watches its health."""

from __future__ import annotations

from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tactile_core.cli.options import BundlePath, ReferencePath, Serial
from tactile_core.cli.output import print_data, print_json
from tactile_core.cli.signals import interrupt_ends

if TYPE_CHECKING:
    from tactile_core.interfaces.sink import Reading
    from tactile_core.pipeline.examination import Check
    from tactile_core.pipeline.health import Health


def doctor(
    profile: Annotated[str | None, typer.Argument(help="A profile to examine as well.")] = None,
    serial: Serial = None,
    sim: Annotated[bool, typer.Option("--sim", help="Open its virtual sensor.")] = False,
    input: Annotated[
        Path | None, typer.Option(help="A recording to examine instead of the devices.")
    ] = None,
    reference: ReferencePath = None,
    bundle: BundlePath = None,
    timeout: Annotated[float, typer.Option(help="Longest wait for an image, s.")] = 1.0,
    watch: Annotated[
        bool, typer.Option("--watch", help="Show the health until Ctrl-C or the end.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object; with --watch, one a second.")
    ] = False,
) -> None:
    """Examine the installed plugins, and a sensor part by part, and say what to do."""
    from tactile_core.errors import InputError
    from tactile_core.pipeline.examination import examine, examine_plugins, exit_code_of

    if profile is None and (sim or watch or input or reference or bundle or serial):
        raise InputError("these options are about a sensor; name its profile")
    if input is not None and sim:
        raise InputError("--input and --sim exclude each other; give one of them")
    options: dict[str, Any] = {
        "serial": serial,
        "sim": sim,
        "input": input,
        "reference": reference,
        "bundle": bundle,
        "timeout_s": timeout,
    }
    if watch and profile is not None:
        _watch(profile, options, as_json)
        return
    checks: list[Check] = []
    for examined in (examine_plugins(), examine(profile, **options) if profile else ()):
        for check in examined:
            checks.append(check)
            if not as_json:
                _print(check)
    code = exit_code_of(checks)
    if as_json:
        verdict = "problem" if code else "ok"
        keys = ("part", "verdict", "message")
        found = [{key: getattr(check, key) for key in keys} for check in checks]
        print_json({"verdict": verdict, "checks": found})
    if code:
        raise typer.Exit(code)


def _print(check: Check) -> None:
    verdict = check.verdict.upper() if check.verdict == "problem" else check.verdict
    if check.verdict == "ok":
        print_data(f"{verdict:<9}{check.part}{f': {check.message}' if check.message else ''}")
        return
    print_data(f"{verdict:<9}{check.part}")
    if check.message:
        print_data(f"{'':<9}{check.message}")


def _watch(profile: str, options: dict[str, Any], as_json: bool) -> None:
    from tactile_core.pipeline.opening import open_sensor

    show = _print_json if as_json else _print_line
    with interrupt_ends(), open_sensor(profile, **options) as sensor:
        last, shown_s = None, float("-inf")
        for reading in sensor.stream():
            last = reading
            if monotonic() - shown_s >= 1.0:  # [s] between two lines of `--watch`
                show(reading, sensor.health())
                last, shown_s = None, monotonic()
        if last is not None:
            show(last, sensor.health())


def _print_json(reading: Reading, health: Health) -> None:
    frame = reading.frame
    place = {"sequence": frame.sequence, "timestamp_s": frame.timestamp_s, "source": reading.source}
    print_json({**place, **health.summary()})


def _print_line(reading: Reading, health: Health) -> None:
    from tactile_core.pipeline.examination import quantity_text

    known = [
        f"{name.replace('_', ' ')} {quantity_text(found)}"
        for name, found in health.findings()
        if found.value is not None
    ]
    print_data(f"{reading.source}: {', '.join(known)}")
    for sentence in health.warnings:
        print_data(f"{'':<9}{sentence}")
