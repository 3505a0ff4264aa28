"""``tactile view``: the live page of one sensor or several."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import GelName, Script, TimeoutS
from tactile_core.cli.output import print_data, print_message
from tactile_core.cli.signals import interrupt_ends


def view(
    profile: Annotated[
        list[str],
        typer.Argument(help="Names of profiles or paths of their YAML files, one per sensor."),
    ],
    serial: Annotated[
        list[str] | None,
        typer.Option(help="Serial of the physical unit; repeat it for several units."),
    ] = None,
    gel: GelName = None,
    sim: Annotated[
        bool, typer.Option("--sim", help="Use the virtual sensor; the page moves an object on it.")
    ] = False,
    script: Script = None,
    input: Annotated[
        list[Path] | None,
        typer.Option(help="An image, a folder of images, a video or a scan; one per sensor."),
    ] = None,
    reference: Annotated[
        list[str] | None,
        typer.Option(help="The sensor with no contact: a path, or 'first'; one per sensor."),
    ] = None,
    bundle: Annotated[
        list[Path] | None,
        typer.Option(help="Calibration bundle; one per sensor. Default: the bundle of the unit."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for snapshots and recordings.")] = Path(
        "tactile-view"
    ),
    timeout: TimeoutS = 1.0,
    reconnect_s: Annotated[
        float,
        typer.Option(help="How long a tare outlives an unplugged camera, s."),
    ] = 10.0,
    host: Annotated[
        str, typer.Option(help="Address to serve the page on; others can reach it, too.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port of the page; 0 chooses a free one.")
    ] = 8750,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Only print the address of the page.")
    ] = False,
) -> None:
    """Show sensors live in a browser: pictures, height, contact, slip, numbers and health.

    Prints the address of the page, which only this computer can open unless --host says otherwise.
    Ctrl-C ends it.
    """
    from platformdirs import user_data_path

    from tactile_core.recordings.output_folder import OutputFolder
    from tactile_live.desk import Desk
    from tactile_live.guiding import own_token
    from tactile_live.live_sensor import LiveSensor
    from tactile_live.opening import open_live, wanted_sensors
    from tactile_live.server import LivePage

    wanted = wanted_sensors(
        profile,
        serials=serial or [],
        inputs=input or [],
        references=reference or [],
        bundles=bundle or [],
    )
    OutputFolder(out)
    with interrupt_ends(), ExitStack() as opened:
        desks: list[Desk] = []
        for one in wanted:
            sensor = open_live(
                one,
                gel=gel,
                sim=sim,
                script=script,
                timeout_s=timeout,
                reconnect_s=reconnect_s,
                say=print_message,
            )
            live = LiveSensor(sensor, out)
            desks.append(Desk(live))
            opened.callback(desks[-1].close)
            for note in sensor.notes:
                print_message(f"note: {sensor.name}: {note}")
        token = own_token(user_data_path("tactile-core"))
        page = opened.enter_context(LivePage(desks, token, host=host, port=port, say=print_message))
        for desk in desks:
            desk.live.start()
        print_data(page.address)
        print_message("open this address in a browser; Ctrl-C ends")
        if not no_browser:
            import webbrowser

            webbrowser.open(page.address)
        page.wait()
