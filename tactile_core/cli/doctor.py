"""``tactile doctor`` and ``tactile devices``: the installation, a sensor, what is plugged in."""

from __future__ import annotations

from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tactile_core.cli.options import AsJson, BundlePath, ReferencePath, Serial
from tactile_core.cli.output import print_data, print_json, print_message
from tactile_core.cli.signals import interrupt_ends

if TYPE_CHECKING:
    from tactile_core.acquisition.unit_devices import DeviceList, ListedDevice
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


def devices(
    claim: Annotated[
        str | None,
        typer.Option(
            metavar="SERIAL=DEVICE",
            help="Remember that a device, by its serial or port, belongs to the sensor SERIAL.",
        ),
    ] = None,
    forget: Annotated[
        str | None,
        typer.Option(metavar="SERIAL", help="Forget the devices of the sensor SERIAL."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the connected cameras and light boxes, with the sensor that each belongs to."""
    from tactile_core.acquisition.unit_devices import (
        IN_WORDS,
        claim_device,
        forget_devices,
        list_devices,
    )
    from tactile_core.errors import InputError

    if claim is not None and forget is not None:
        raise InputError("--claim and --forget exclude each other; give one of them")
    if claim is not None:
        unit, equals, device = claim.partition("=")
        if not (unit and equals and device):
            raise InputError(
                f"--claim {claim}: write SERIAL=DEVICE, for example F12=C310A001, with a serial or "
                f"port that 'tactile devices' lists"
            )
        for one in claim_device(unit, device):
            former = f", no longer of {one.unit}" if one.unit not in (None, unit) else ""
            print_message(f"{one.device} is the {IN_WORDS[one.kind]} of {unit}{former}")
    if forget is not None:
        for kind, held in forget_devices(forget).items():
            print_message(f"{held} is no longer the {IN_WORDS[kind]} of {forget}")
    found = list_devices()
    for note in found.notes:
        print_message(f"note: {note}")
    if as_json:
        print_json({"devices": list(map(_entry, found.devices)), "claims": _claims(found)})
    else:
        _print_table(found)


def _entry(one: ListedDevice) -> dict[str, Any]:
    device = one.device
    vendor, product = (device.usb_id or ":").split(":")
    return {
        "usb_id": device.usb_id,
        "vendor_id": int(vendor, 16) if vendor else None,
        "product_id": int(product, 16) if product else None,
        "product": device.product or None,
        "serial": device.serial,
        "port_path": device.port_path,
        "kind": one.kind,
        "use": one.use,
        "place": device.place or None,
        "held_by": list(device.held_by),
        "unit": one.unit,
        "profiles": list(one.profiles),
    }


def _claims(found: DeviceList) -> list[dict[str, Any]]:
    return [
        {
            "unit": unit,
            "kind": kind,
            **claim.model_dump(),
            "connected": found.is_connected(unit, kind),
        }
        for unit, held in found.claims.units.items()
        for kind, claim in held.items()
    ]


def _print_table(found: DeviceList) -> None:
    from tactile_core.acquisition.unit_devices import IN_WORDS
    from tactile_core.cli.output import table_lines

    header = ["id", "port", "serial", "product", "at", "use", "unit", "in use by", "profiles"]
    rows = [
        [
            one.device.usb_id or "-",
            one.device.port_path or "-",
            one.device.serial or "-",
            one.device.product or "-",
            one.device.place or "-",
            one.use,
            one.unit or "-",
            " and ".join(one.device.held_by) or "-",
            ", ".join(one.profiles) or "-",
        ]
        for one in found.devices
    ]
    if not rows:
        print_message("no camera and no light box is connected")
    for line in table_lines(header, rows) if rows else ():
        print_data(line)
    for entry in _claims(found):
        if not entry["connected"]:
            claim = found.claims.units[entry["unit"]][entry["kind"]]
            print_data(f"not connected: {claim}, the {IN_WORDS[entry['kind']]} of {entry['unit']}")
