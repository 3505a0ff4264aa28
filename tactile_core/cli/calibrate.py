"""``tactile calibrate``, ``calibrate-force`` and ``import``: what makes a bundle."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from tactile_core.cli.options import AsJson, BundlePath, ProfileName, ReferencePath, Serial
from tactile_core.cli.output import ask, print_data, print_json, print_message

_QUESTION = (
    "How were the ball's diameter and the scale measured, e.g. 'calliper, 0.02 mm' (nothing if "
    "unknown)? Most errors in them show nowhere else."
)


def calibrate(
    profile: ProfileName,
    presses: Annotated[
        Path | None,
        typer.Option(
            help="Recording of the ball, pressed at different places, or of a session with --live."
        ),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Be led from press to press by the live image.")
    ] = False,
    reference: Annotated[
        str | None,
        typer.Option(
            help="Recording of the sensor with no contact, or 'median' of the presses; optional "
            "with a .tmd target."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the bundle. Default: in the user's data directory."),
    ] = None,
    ball_diameter_mm: Annotated[
        float | None,
        typer.Option(help="Diameter in mm of every ball that no catalog.csv in --presses lists."),
    ] = None,
    labels: Annotated[
        Path | None,
        typer.Option(
            help="Circles that replace the detected ones: a CSV, or a folder labelled by gs_sdk."
        ),
    ] = None,
    target: Annotated[
        Path | None, typer.Option(help="Calibration target: YAML of a ball grid, or .tmd.")
    ] = None,
    rows: Annotated[
        str | None, typer.Option(help="A:B, the rows of the .tmd target to use.")
    ] = None,
    measured_with: Annotated[
        str | None,
        typer.Option(help="How ball and scale were measured, e.g. 'calliper, 0.02 mm'."),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(help="Calibration model, plugin.name. Default: the model in the profile."),
    ] = None,
    serial: Annotated[str, typer.Option(help="Serial of the physical unit.")] = "",
    gel: Annotated[str, typer.Option(help="Name of the gel on the unit, which wears.")] = "",
    record: Annotated[
        Path | None,
        typer.Option(help="With --live: the session's recording. Default: beside the bundle."),
    ] = None,
    sim: Annotated[bool, typer.Option("--sim", help="With --live: the virtual sensor.")] = False,
    script: Annotated[
        Path | None, typer.Option(help="With --live --sim: YAML of the indenter and its motion.")
    ] = None,
    input: Annotated[
        Path | None, typer.Option(help="With --live: a recording instead of the camera.")
    ] = None,
    timeout: Annotated[
        float, typer.Option(help="With --live: longest wait for an image, s.")
    ] = 1.0,
    reconnect_s: Annotated[
        float, typer.Option(help="With --live: how long to try to open an unplugged camera, s.")
    ] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Fit a calibration, score it on held-out presses and write its bundle."""
    from tactile_core.bundles.places import check_place, check_serial, default_place
    from tactile_core.calibration.fitting import calibrate as fit
    from tactile_core.calibration.fitting import inputs_of
    from tactile_core.calibration.target_surface import parse_rows
    from tactile_core.cli.guided_calibration import calibrate_live, report_calibration
    from tactile_core.cli.output import Bar
    from tactile_core.errors import InputError
    from tactile_core.pipeline.workers import available_cores
    from tactile_core.plugins.options import fittable_calibrator
    from tactile_core.profiles.loader import load_profile

    loaded = load_profile(profile)
    fittable_calibrator(loaded.calibration, model)  # before anything is asked
    if serial:
        check_serial(serial)
    if gel:
        check_serial(gel, "gel")
    folder = out if out is not None else default_place(loaded, serial or None, gel or None)
    inputs_of(profile, input if live else presses, reference, labels, target).refuse_whole(folder)
    check_place(folder)
    if measured_with is None:
        asked = sys.stdin.isatty() and not as_json and (live or presses is not None)
        measured_with = ask(_QUESTION) if asked else ""
    if live:
        if presses is not None or labels is not None or target is not None or rows is not None:
            raise InputError(
                "--live takes its presses from the camera; leave --presses, --labels, "
                "--target and --rows out"
            )
        if ball_diameter_mm is None:
            raise InputError("--live needs the ball; give --ball-diameter-mm")
        calibrate_live(
            profile,
            folder,
            ball_diameter_mm,
            reference=reference,
            record=record,
            model=model,
            serial=serial,
            gel=gel,
            measured_with=measured_with,
            input=input,
            script=script,
            sim=sim,
            timeout_s=timeout,
            reconnect_s=reconnect_s,
            as_json=as_json,
        )
        return
    if presses is None:
        raise InputError("give --presses, a recording of the ball, or --live to be led")
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
            gel=gel,
            progress=progress,
            workers=available_cores(),
        )
    result = result.measured_with(measured_with)
    result.save(folder)
    report_calibration(result, folder, as_json=as_json)


def calibrate_force(
    profile: ProfileName,
    input: Annotated[
        list[Path],
        typer.Option(
            help="A recording of presses whose force was measured; or several, in a folder or by "
            "several --input."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the bundle with the force model.")],
    forces: Annotated[
        list[Path] | None,
        typer.Option(
            help="CSV with frame, file or time_s, and fx_n,fy_n,fz_n,tz_nmm, of which some may be "
            "missing. One for each recording: several --forces, or a folder with NAME.csv."
        ),
    ] = None,
    weights: Annotated[
        Path | None,
        typer.Option(help="Instead of --forces: CSV file,mass_g of masses laid on the sensor."),
    ] = None,
    bundle: BundlePath = None,
    reference: ReferencePath = None,
    serial: Serial = None,
    step: Annotated[
        str | None, typer.Option(help="Step to fit. Default: the only one that can be fitted.")
    ] = None,
    align: Annotated[
        bool,
        typer.Option("--align", help="Turn the forces into the image's axes, as estimated."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Fit the force step of a profile to measured forces, and score it on held-out sequences.

    A sequence is a recording or, if there is only one, a press between two rests. The bundle is a
    copy of the unit's with the force model added, or holds that model alone.
    """
    from tactile_core.bundles.places import check_place, check_serial
    from tactile_core.calibration.force.fitting import calibrate_force as fit
    from tactile_core.cli.output import Bar, table_lines
    from tactile_core.pipeline.initial_reference import reference_path
    from tactile_core.recordings.inputs import PROFILE, Inputs

    if serial:
        check_serial(serial)
    given: dict[str, Path | str | None] = {
        PROFILE: profile,
        "--reference": reference_path(reference),
        "--weights": weights,
        **{f"--input {number}": path for number, path in enumerate(input, 1)},
        **{f"--forces {number}": path for number, path in enumerate(forces or (), 1)},
    }
    Inputs.from_paths(given).refuse_whole(out)
    check_place(out)
    with Bar() as progress:
        result = fit(
            profile,
            input,
            forces or (),
            weights=weights,
            bundle=bundle,
            reference=reference,
            serial=serial,
            step=step,
            align=align,
            progress=progress,
        )
    result.save(out)
    for note in result.notes:
        print_message(f"note: {note}")
    if as_json:
        print_json(result.summary(out))
        return
    print_data(
        f"{out}: step {result.step!r} fitted to {result.frames} frames in {result.sequences} "
        f"sequences"
    )
    for line in (*table_lines(*result.table()), *result.sentences()):
        print_data(line)


def import_(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="The calibration that another program made.")
    ],
    kind: Annotated[str, typer.Option("--as", help="The importer that reads it, plugin.name.")],
    profile: Annotated[
        str, typer.Option(help="The sensor that it was made for: a profile's name or YAML file.")
    ],
    reference: Annotated[
        Path | None,
        typer.Option(help="Recording of the sensor with no contact, which the bundle keeps."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the bundle. Default: in the user's data directory."),
    ] = None,
    serial: Annotated[str, typer.Option(help="Serial of the physical unit.")] = "",
    gel: Annotated[str, typer.Option(help="Name of the gel on the unit.")] = "",
    as_json: AsJson = False,
) -> None:
    """Make a bundle of a calibration in another program's format."""
    from tactile_core.bundles.manifest import is_measured
    from tactile_core.bundles.places import check_place, default_place
    from tactile_core.calibration.imported import import_calibration
    from tactile_core.errors import InputError
    from tactile_core.profiles.loader import load_profile
    from tactile_core.recordings.inputs import PROFILE, Inputs

    loaded = load_profile(profile)
    folder = out if out is not None else default_place(loaded, serial or None, gel or None)
    inputs = Inputs.from_paths({"FILE": file, PROFILE: profile, "--reference": reference})
    inputs.refuse_whole(folder)
    if is_measured(check_place(folder)):
        raise InputError(
            f"{folder} holds a calibration that was made from presses; name another folder by "
            f"--out, or move that one away"
        )
    bundle = import_calibration(file, kind, loaded, reference=reference, serial=serial, gel=gel)
    bundle.save(folder)
    model = bundle.manifest.model
    if bundle.reference is None:
        print_message(
            "note: the bundle holds no reference; give --reference to each command that uses it"
        )
    if as_json:
        imported = {"kind": kind, "file": file.name}
        print_json({"bundle": str(folder), "model": model, "imported": imported, "held_out": None})
        return
    print_data(f"{folder}: {model}, imported from {file}; nothing is known of its errors")
