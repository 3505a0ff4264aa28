"""``tactile devices``: which USB cameras are plugged in."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from tactile_core.cli.output import say, say_json


def devices(
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """List the USB cameras that are plugged in, any of which may be a sensor's."""
    from tactile_core.acquisition.usb_devices import usb_cameras
    from tactile_core.cli.table import table_lines

    found = usb_cameras()
    if as_json:
        say_json({"devices": [{"usb_id": one.usb_id, **asdict(one)} for one in found]})
        return
    rows = [[one.usb_id, one.port_path, one.serial or "-", one.product or "-"] for one in found]
    if rows:
        for line in table_lines(["id", "port", "serial", "product"], rows):
            say(line)
