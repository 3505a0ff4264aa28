"""``tactile ros2``: publishes a sensor live to ROS 2."""

from __future__ import annotations

from contextlib import nullcontext
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactile_core.cli.options import (
    BundlePath,
    GelName,
    MostFrames,
    ProfileName,
    ReconnectS,
    ReferencePath,
    Script,
    Serial,
    Simulated,
    TimeoutS,
)
from tactile_core.cli.output import Warnings, print_data, print_if_fewer, print_message
from tactile_core.cli.signals import interrupt_ends

if TYPE_CHECKING:
    from tactile_core.profiles.model import Profile


def ros2(
    profile: ProfileName,
    serial: Serial = None,
    gel: GelName = None,
    sim: Simulated = False,
    script: Script = None,
    input: Annotated[
        Path | None,
        typer.Option(help="A recording, a folder of images or a video, played in its own time."),
    ] = None,
    reference: ReferencePath = None,
    bundle: BundlePath = None,
    frames: MostFrames = None,
    timeout: TimeoutS = 1.0,
    reconnect_s: ReconnectS = 0.0,
    domain: Annotated[
        int | None,
        typer.Option(help="Domain of the programs that listen. Default: ROS_DOMAIN_ID, or 0."),
    ] = None,
    services: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Offer services for reference, tare and recordings, which go to this folder; "
            "needs ROS.",
        ),
    ] = None,
) -> None:
    """Publish picture, height, points, wrench, slip and health as topics of ROS 2, without ROS.

    Prints each topic and its type. Only topics that somebody subscribes to are computed and
    sent. Ctrl-C ends it.
    """
    from tactile_core.errors import InputError
    from tactile_core.pipeline.opening import open_sensor
    from tactile_ros2.broadcast import Broadcast
    from tactile_ros2.publisher import Publisher, domain_of
    from tactile_ros2.services import Services

    if input is not None and sim:
        raise InputError("--input and --sim exclude each other; give one of them")
    number = domain_of(domain)
    with (
        interrupt_ends(),
        open_sensor(
            _endless(profile, script) if sim else profile,
            serial=serial,
            gel=gel,
            bundle=bundle,
            input=input,
            reference=reference,
            script=None if sim else script,
            timeout_s=timeout,
            reconnect_s=reconnect_s,
        ) as sensor,
        Publisher(number) as publisher,
        nullcontext() if services is None else Services(sensor, number, services) as offered,
    ):
        for note in sensor.notes:
            print_message(f"note: {note}")
        broadcast = Broadcast(sensor, publisher, lambda note: print_message(f"note: {note}"))
        for topic, kind in broadcast.topics.items():
            print_data(f"{topic} {kind}")
        warnings = Warnings(sensor.notes)
        count = 0
        for count, published in enumerate(islice(broadcast.publish(), frames), 1):  # noqa: B007
            warnings.print(published.reading.warnings)
            if offered is not None:
                offered.spin()
        print_if_fewer(count, frames)


def _endless(profile: str, script: Path | None) -> Profile:
    """Return the profile of a virtual sensor whose movements begin anew when they have ended."""
    from tactile_core.interfaces.component import VIRTUAL_CAMERA
    from tactile_core.profiles.loader import load_profile

    given = {} if script is None else {"script": str(script)}
    virtual = load_profile(profile, sim=True, overrides={"camera": given})
    if virtual.camera.use != VIRTUAL_CAMERA:
        return virtual
    return load_profile(profile, sim=True, overrides={"camera": {**given, "loop": True}})
