"""Guided calibration at the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from tactile_core.cli.output import print_data, print_json, print_message, terminal

if TYPE_CHECKING:
    from tactile_core.calibration.guided.session import GuidedCalibration
    from tactile_core.calibration.guided.touch import Guidance
    from tactile_core.calibration.result import Calibrated
    from tactile_core.pipeline.sensor import Sensor
    from tactile_core.profiles.model import Profile


def calibrate_live(
    profile: str,
    out: Path,
    ball_diameter_mm: float,
    *,
    reference: Path | str | None,
    record: Path | None,
    model: str | None,
    serial: str,
    gel: str,
    measured_with: str,
    input: Path | None,
    script: Path | None,
    sim: bool,
    timeout_s: float,
    reconnect_s: float,
    as_json: bool,
) -> None:
    """Lead a person through a calibration, and save it.

    Parameters are those of ``tactile calibrate --live``; ``record`` is by default beside the
    bundle.
    """
    from tactile_core.calibration.guided.session import GuidedCalibration
    from tactile_core.pipeline.sensor import Sensor

    path = record or _free(out)
    with ExitStack() as opened:
        if sim and script is None:
            folder = opened.enter_context(TemporaryDirectory(prefix="tactile-script-"))
            script = _script_of_presses(profile, Path(folder), ball_diameter_mm)
        # without its bundle, which is about to be replaced and may not fit
        sensor = opened.enter_context(
            Sensor(
                _profile_of(profile, sim, script, None if input else serial),
                None,
                reference,
                serial=serial or None,
                input=input,
                timeout_s=timeout_s,
                reconnect_s=reconnect_s,
            ).open()
        )
        if reference is None:
            print_message("Keep your hands off the gel: the reference is taken.")
            # [frames] time to take the hand away, and for the camera to settle
            for _ in range(15 if sensor.is_live else 0):
                sensor.acquire()
            sensor.capture_reference()
        undeformed = sensor.pipeline.reference
        assert undeformed is not None
        with (
            sensor.record(path) as recording,
            GuidedCalibration(
                sensor.profile,
                undeformed,
                ball_diameter_mm,
                model=model,
                serial=serial,
                gel=gel,
                note=recording.add_event,
            ) as guided,
            _explain_recovery(guided, path, f"tactile calibrate {profile} --presses {path}", out),
        ):
            _lead(sensor, guided, as_json=as_json)
            print_message(f"{len(guided.presses)} presses are kept; fitting and scoring.")
            result = guided.finish().measured_with(measured_with)
            result.save(out)
        if recording.failure is not None:
            print_message(f"note: {recording.failure}")
        report_calibration(result, out, path, as_json=as_json)
        if input is None:
            _measure_next(sensor, result, as_json=as_json)


def _script_of_presses(profile: str, folder: Path, ball_diameter_mm: float) -> Path:
    from tactile_core.interfaces.component import SIMULATOR
    from tactile_core.plugins.registry import resolve
    from tactile_core.profiles.loader import load_profile

    simulator = resolve("simulator", SIMULATOR)()
    path = folder / "presses.yaml"
    build = load_profile(profile, sim=True)
    simulator.write_script(build, path, ball_diameter_mm=ball_diameter_mm)
    return path


def _profile_of(name: str, sim: bool, script: Path | None, serial: str | None) -> Profile:
    from tactile_core.acquisition.unit_devices import with_unit_devices
    from tactile_core.errors import InputError
    from tactile_core.profiles.loader import load_profile

    if script is not None and not sim:
        raise InputError(f"the script {script} controls the virtual sensor; add --sim")
    overrides = None if script is None else {"camera": {"script": str(script)}}
    profile = load_profile(name, sim=sim, overrides=overrides)
    return with_unit_devices(profile, serial) if serial else profile


def _lead(sensor: Sensor, guided: GuidedCalibration, *, as_json: bool) -> None:
    """Feed live frames until more presses would not help, or a recording ends."""
    image = sensor.profile.image
    with open_display((image.width_px, image.height_px), as_json=as_json) as show:
        while (frame := sensor.acquire()) is not None:
            guidance = guided.feed(frame)
            show(guidance)
            if guidance.examining and not sensor.is_live:
                guided.wait()  # simulated time is faster than the examination
            if guidance.done:
                return
        guided.wait()


@contextmanager
def _explain_recovery(
    guided: GuidedCalibration, path: Path, command: str, out: Path
) -> Iterator[None]:
    """Say how to finish from the recording if the session ends early."""
    try:
        yield
    except BaseException:
        count = len(guided.presses)
        if count:
            print_message(f"{count} presses are kept in {path}; finish with: {command} --out {out}")
        else:
            print_message(f"no press was kept; {path} holds what the camera sent")
        raise


def report_calibration(
    result: Calibrated, out: Path, recording: Path | None = None, *, as_json: bool
) -> None:
    """Print a calibration that is saved in a folder."""
    for note in result.notes:
        print_message(f"note: {note}")
    if as_json:
        recorded = {} if recording is None else {"recording": str(recording)}
        print_json({**result.summary(out), **recorded})
        return
    for press in result.presses:
        if not press.used:
            print_message(f"left out {press.file}: {press.why}")
    print_data(f"{out}: {result.bundle.manifest.model} on {result.basis}")
    for sentence in () if result.score is None else result.score.sentences(result.coverage()):
        print_data(sentence)
    if recording is not None:
        print_data(f"the session is recorded in {recording}; the report is {out / 'report.html'}")


def _measure_next(sensor: Sensor, result: Calibrated, *, as_json: bool) -> None:
    """Measure the next thing that touches and holds still, with the new calibration."""
    from tactile_core.calibration.guided.touch import next_touch
    from tactile_core.pipeline.pipeline import Pipeline
    from tactile_core.plugins.blame import blame_of

    print_message("Lift the ball, then touch the gel with anything: it is measured. Ctrl-C ends.")
    frame = next_touch(iter(sensor.acquire, None), result.bundle)
    if frame is None:
        return
    pipeline = Pipeline(sensor.profile, result.bundle)
    measured = pipeline.process(frame).summary(blame_of)
    if as_json:
        print_json({"measured": measured})
        return
    depth, area = measured["max_height_mm"], measured["contact_area_mm2"]
    depth_words = "no depth" if depth is None else f"{depth:.3f} mm deep"
    print_data(f"measured: {depth_words}" + (f", {area:.2f} mm²" if area else ""))


def _free(out: Path) -> Path:
    """Return the path of a new recording beside the bundle."""
    name = out.resolve().name
    first = out.with_name(f"{name}.mcap")
    numbered = (out.with_name(f"{name}_{number}.mcap") for number in range(2, 10_000))
    return first if not first.exists() else next(path for path in numbered if not path.exists())


COLUMNS = 48  # Width of the map, characters
SHADES = " .:+#"
"""From nothing covered to all."""
TARGET, IMPRINT = "O", "x"

Show = Callable[["Guidance"], None]


@contextmanager
def open_display(size_px: tuple[int, int], *, as_json: bool) -> Iterator[Show]:
    """Yield what shows a guidance.

    Parameters
    ----------
    size_px : (width, height)
        Of the image.
    as_json : bool
        Print an object whenever the advice changes, instead of text.
    """
    screen = terminal()
    if as_json:
        yield _on_change(lambda guidance: print_json(guidance.summary()))
    elif screen is None:
        yield _on_change(lambda guidance: print_data(line(guidance)))
    else:
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        with Live(console=Console(file=screen), auto_refresh=False) as live:
            yield lambda guidance: live.update(Text(page(guidance, size_px)), refresh=True)


def line(guidance: Guidance) -> str:
    """Return the advice, the number of presses and the score in one line."""
    return f"{guidance.say} ({_numbers(guidance)})"


def page(guidance: Guidance, size_px: tuple[int, int]) -> str:
    """Return the advice with a map of the view: shades for what is covered, O where to press."""
    width = COLUMNS
    # a character is about twice as high as wide
    height = max(1, round(COLUMNS / 2 * size_px[1] / size_px[0]))
    rows, columns = guidance.coverage.shape
    y = (np.arange(height) * rows) // height
    x = (np.arange(width) * columns) // width
    level = np.rint(guidance.coverage[np.ix_(y, x)] * (len(SHADES) - 1)).astype(int)
    cells = [[SHADES[value] for value in row] for row in level]
    for place, sign in ((guidance.target_px, TARGET), (guidance.imprint_px, IMPRINT)):
        if place is not None:
            column = int(np.clip(place[0] * width / size_px[0], 0, width - 1))
            row = int(np.clip(place[1] * height / size_px[1], 0, height - 1))
            cells[row][column] = sign
    border = f"+{'-' * width}+"
    drawn = [border, *(f"|{''.join(row)}|" for row in cells), border]
    warning = [f"note: {guidance.warning}"] if guidance.warning else []
    legend = f"{TARGET} press here, {IMPRINT} the imprint, {SHADES[-1]} covered. Ctrl-C to end."
    return "\n".join([guidance.say, *drawn, _numbers(guidance), *warning, legend])


def _numbers(guidance: Guidance) -> str:
    score = "no score yet" if guidance.held_out is None else f"normals {guidance.held_out:.2f}°"
    covered = float((guidance.coverage >= 1).mean())
    slopes = float(guidance.slope_coverage.mean())
    return f"{guidance.kept} kept, surface {covered:.0%}, slopes {slopes:.0%}, {score}"


def _on_change(show: Show) -> Show:
    """Call ``show`` only for advice that differs from the one before."""
    last: list[tuple[object, ...]] = [()]

    def changed(guidance: Guidance) -> None:
        now = guidance.say, guidance.kept, guidance.held_out, guidance.warning
        if now != last[0]:
            last[0] = now
            show(guidance)

    return changed
