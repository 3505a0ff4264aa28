"""``tactile devices``: the connected USB cameras."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from tactile_core.cli.output import print_data, print_json


def devices(
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """List the connected USB cameras, with the id and the port for a profile."""
    from tactile_core.acquisition.usb_devices import usb_cameras
    from tactile_core.cli.table import table_lines

    found = usb_cameras()
    if as_json:
        print_json({"devices": [{"usb_id": one.usb_id, **asdict(one)} for one in found]})
        return
    rows = [[one.usb_id, one.port_path, one.serial or "-", one.product or "-"] for one in found]
    if rows:
        for line in table_lines(["id", "port", "serial", "product"], rows):
            print_data(line)
