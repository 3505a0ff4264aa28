"""``tactile devices``: what is connected, and which sensor unit it belongs to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from tactile_core.cli.options import AsJson
from tactile_core.cli.output import print_data, print_json, print_message

if TYPE_CHECKING:
    from tactile_core.acquisition.unit_devices import DeviceList, ListedDevice


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
