"""Damage, full disks, kills: ``PYTHONPATH=tests python benchmarks/recording_faults.py [WHAT …]``.

*damage*: flipped bits, truncations and zeroed halves of MCAP recordings, finished and not.
Counted are images that come back altered, and sound ones that do not come back, as they are read
and as ``tactile recover`` writes them. *disk*: commands whose files may not exceed a size.
*page*: the same for the live page, on which somebody saves, records and calibrates. *kill*:
``kill -9`` while ten busy processes share the processor.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import closing, suppress
from itertools import count
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from support.damaged_recordings import Images, chunks_in, damaged, images_in, record
from support.recordings import SESSION

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit
from tactile_core.errors import InputError, TactileError
from tactile_core.formats.npz import read_npz
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Image
from tactile_core.recordings.recovery import recover
from tactile_core.recordings.running_recording import RunningRecording
from tactile_core.recordings.source import recording_writer
from tactile_live.desk import Desk
from tactile_live.live_sensor import LiveSensor
from tactile_live.opening import WantedSensor, open_live
from tactile_live.server import LivePage

_SPAWN = get_context("spawn")  # a library's threads do not survive a fork
FLIPS, CUTS, HALVES, DISKS, KILLS, LOAD = 500, 100, 50, 60, 60, 10


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    tried = {
        "damage": print_damage,
        "disk": print_disks,
        "page": print_pages,
        "kill": print_kills,
    }
    parser.add_argument("what", nargs="*", choices=[[], *tried], default=list(tried))
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    for what in given.what:
        folder = Path(tempfile.mkdtemp())
        try:
            tried[what](folder, np.random.default_rng(given.seed))
        finally:
            shutil.rmtree(folder)


def print_damage(folder: Path, rng: np.random.Generator) -> None:
    for name, finished in (("finished", True), ("unfinished", False)):
        whole = folder / f"{name}.mcap"
        record(whole, finished=finished)
        data, sent = whole.read_bytes(), images_in(whole)
        chunks = list(chunks_in(data, sent))
        for kind, cases in damages(len(data), rng).items():
            counts: Counter[str] = Counter()
            for first, last, mask in cases:
                kept = {n for n, begin, end in chunks if end <= first or begin >= last}
                bad = damaged(data, first, last, mask)
                counts.update(tried_on(folder / "bad.mcap", bad, sent, kept))
            print(f"{name}, {kind}: {len(cases)} files, {dict(counts)}", flush=True)


def damages(size: int, rng: np.random.Generator) -> dict[str, list[tuple[int, int, int]]]:
    """Return first and last byte of each damage, and the bits that flip: 0 zeroes, -1 cuts off."""
    flips = [
        (int(at), int(at) + 1, 1 << int(rng.integers(8))) for at in rng.integers(0, size, FLIPS)
    ]
    cuts = [(int(at), size, -1) for at in rng.integers(0, size, CUTS)]
    starts = [0, size // 2, *rng.integers(0, size // 2, HALVES - 2)]
    halves = [(int(at), int(at) + size // 2, 0) for at in starts]
    return {"flipped bits": flips, "truncations": cuts, "zeroed halves": halves}


def tried_on(path: Path, data: bytes, sent: Images, kept: set[int]) -> Counter[str]:
    """Count what is wrong with what is read of a damaged file, and of what is recovered from it."""
    path.write_bytes(data)
    fresh = path.with_suffix(".recovered.mcap")
    fresh.unlink(missing_ok=True)
    counts = Counter({"altered": 0, "lost": 0, "altered by recover": 0, "lost by recover": 0})
    try:
        found = images_in(path)
    except InputError:
        counts.update({"refused": 1, "lost": len(kept)})
        return counts
    counts["altered"] = sum(found[n] != sent[n] for n in found)
    counts["lost"] = len(kept - set(found))
    try:
        again = images_in(recover(path).path)
    except InputError:
        return counts
    counts["altered by recover"] = sum(again[n] != sent[n] for n in again)
    counts["lost by recover"] = len(kept - set(again))
    return counts


def print_disks(folder: Path, rng: np.random.Generator) -> None:
    """Run each command with files that may not exceed a size, and count how it ends."""
    source, cut, profile = folder / "source.mcap", folder / "cut.mcap", folder / "small.yaml"
    record(source, finished=True, bundle=False)
    cut.write_bytes(source.read_bytes()[: source.stat().st_size * 9 // 10])
    profile.write_text(SESSION.profile)
    given = {path: path.read_bytes() for path in (source, cut, profile)}
    plain = ["--input", source, "--reference", "first"]
    measuring = ["--readings", "--reference", "first"]
    commands = {
        "record": ["record", profile, *plain, "--readings", "--out", folder / "out.mcap"],
        "record to a folder": ["record", profile, *plain, "--out", folder / "out"],
        "run": ["run", profile, *plain, "--save", "npz,png,record", "--out", folder / "out"],
        "convert": ["convert", source, folder / "out.h5"],
        "convert with readings": ["convert", source, folder / "out.h5", *measuring],
        "recover": ["recover", cut, "--out", folder / "out.mcap"],
    }
    for name, words in commands.items():
        counts: Counter[str] = Counter()
        for limit_bytes in sizes():
            ended = in_a_child(words, limit_bytes)
            left = [p for p in folder.iterdir() if p not in given]
            if any(path.read_bytes() != content for path, content in given.items()):
                ended = "an input is altered"
            if name.startswith(("convert", "recover")) and ended != "exit 0" and left:
                ended += ", something is left behind"
            counts[ended] += 1
            subprocess.run(["rm", "-rf", *left], check=True)
        print(f"{name}: {DISKS} sizes, {dict(counts)}", flush=True)


def sizes() -> list[int]:
    """Return the limits of the size of a file, bytes."""
    return [0, 1, *np.geomspace(10, 1e6, DISKS - 2).astype(int).tolist()]


def in_a_child(words: list[object], limit_bytes: int) -> str:
    """Run a command in a fork, with a limit of the size of each file, and return how it ended."""
    from support.command_line import tactile

    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))
        done = tactile(*words)
        os.write(writing, f"{done.returncode} {done.stderr}".encode()[:60_000])
        gc.collect()
        atexit._run_exitfuncs()  # a library may fall over what a command left open
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        code, _, message = pipe.read().decode().partition(" ")
    _, status = os.waitpid(process, 0)
    if os.WIFSIGNALED(status):
        return signal.Signals(os.WTERMSIG(status)).name
    lines = message.splitlines()
    said = [line for line in lines if not line.startswith(("note: ", "warning: "))]
    if code == "0":
        return "exit 0"
    sentence = len(said) == 1 and "this is a bug" not in message
    return f"exit {code}, {'a sentence' if sentence else 'more than a sentence: ' + message}"


def print_pages(folder: Path, rng: np.random.Generator) -> None:
    """Use the live page while its files may not exceed a size, and count what it answers."""
    from support.virtual_lab import make_lab

    lab = make_lab(folder)
    profile = lab.profile_path.read_text().replace("160, height_px: 120", "96, height_px: 72")
    lab.profile_path.write_text(profile.replace("0.1245", "0.2"))
    bundle = folder / "bundle"
    calibrate_virtual_unit(load_profile(lab.profile_path, sim=True)).save(bundle)
    given = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    counts, wrong = Counter[str](), Counter[str]()
    for limit_bytes in sizes():
        out = folder / "pages"
        here, there = _SPAWN.Pipe(duplex=False)
        given_to = lab.profile_path, bundle, out, limit_bytes, there
        process = _SPAWN.Process(target=used_page, args=given_to)
        process.start()
        there.close()
        with suppress(EOFError):
            while True:
                counts[here.recv()] += 1
        process.join()
        if process.exitcode:
            wrong[f"exit {process.exitcode} with {limit_bytes} bytes"] += 1
        if any(path.read_bytes() != content for path, content in given.items()):
            wrong["an earlier file is altered"] += 1
        wrong.update(fault for path in sorted(out.glob("*")) if (fault := unsound(path)))
        shutil.rmtree(out, ignore_errors=True)
    print(f"page: {DISKS} sizes, wrong: {dict(wrong)}")
    for answer, times in sorted(counts.items()):
        print(f"  {times} × {answer}", flush=True)


def used_page(profile: Path, bundle: Path, out: Path, limit_bytes: int, answers: Any) -> None:
    """Save, record and calibrate on the page of a virtual sensor, and send each answer."""
    from support.watching import TOKEN, until, watching

    resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))
    sensor = open_live(WantedSensor(str(profile), bundle=bundle), sim=True)
    live = LiveSensor(sensor, out)
    desk = Desk(live.start())
    with closing(desk), LivePage([desk], TOKEN) as page, watching(page.address) as browser:
        until(lambda: live.newest.value is not None)

        def click(**command: object) -> None:
            answer = browser.ask(**command)
            said = answer.get("refused") or answer["done"]
            sentence = "\n" not in said and "bug" not in said and not re.match(r"\w+Error", said)
            how = "done" if "done" in answer else "a sentence" if sentence else f"not so: {said}"
            answers.send(f"{command['do']}: {how}")

        click(do="snapshot")
        click(do="record", on=True)
        after = live.newest.count + 10
        until(lambda: live.newest.count > after)
        click(do="record", on=False)
        click(do="take", kind="sphere", size_mm=4.0)
        click(do="calibrate", on=True, ball_diameter_mm=4.0)
        if desk.guiding.state:
            until(lambda: live.guidance and live.guidance.target_px)
            image = sensor.profile.image
            middle_px = (image.width_px - 1) / 2, (image.height_px - 1) / 2
            x_mm, y_mm = image.mm_per_px * np.subtract(live.guidance.target_px, middle_px)
            browser.say(do="move", x_mm=x_mm, y_mm=y_mm, angle_deg=0.0, depth_mm=0.6, pressed=True)
            end_s = time.monotonic() + 15  # a slow computer may keep no press
            while time.monotonic() < end_s and not (live.guidance and live.guidance.kept):
                time.sleep(0.05)
        click(do="finish")
        click(do="calibrate", on=False)
        before = live.newest.count
        until(lambda: live.newest.count > before)  # it measures on


def unsound(path: Path) -> str:
    """Return what is wrong with a file or folder that the page left; empty if nothing is."""
    try:
        if path.suffix == ".mcap":
            images_in(path)
        elif path.name.endswith("_bundle"):
            Bundle.load(path)
        elif path.is_dir():
            for file in path.glob("*.npz"):
                read_npz(file)
        elif path.name.startswith((".", "tmp")):
            return f"{path.name} is left behind"
    except TactileError as error:
        # a recording that was cut off before its session says so
        return "" if path.suffix == ".mcap" else str(error)
    return ""


BUSY = "import time\nend_s = time.monotonic() + 600\nwhile time.monotonic() < end_s: pass"


def print_kills(folder: Path, rng: np.random.Generator) -> None:
    """Kill recorders while others use the processor, and print the age of the oldest lost image."""
    busy = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(LOAD)]
    try:
        ages_s = [
            age_of_lost(folder / "killed.mcap", after_s) for after_s in rng.uniform(0, 3, KILLS)
        ]
    finally:
        for process in busy:
            process.kill()
    late = sum(age_s > 0.5 for age_s in ages_s)
    print(
        f"{KILLS} kills, load {os.getloadavg()[0]:.0f}: {late} lost an image older than 0.5 s; the "
        f"oldest that was lost had arrived {1e3 * max(ages_s):.0f} ms before"
    )


def age_of_lost(path: Path, after_s: float) -> float:
    """Record until a kill, and return the age of the oldest image that is lost; 0 if none is."""
    path.unlink(missing_ok=True)
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        record_for_good(path, writing)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        lines = [pipe.readline()]
        time.sleep(after_s)
        killed_s = time.monotonic()
        os.kill(process, signal.SIGKILL)
        lines += list(pipe)
    os.waitpid(process, 0)
    arrived = dict(line.split() for line in lines if line.endswith("\n"))
    found = images_in(path)
    lost_s = [float(s) for number, s in arrived.items() if int(number) not in found]
    return max(0.0, killed_s - min(lost_s, default=killed_s))


def record_for_good(path: Path, writing: int) -> NoReturn:
    """Record 60 images a second, and write number and time of each to a pipe."""
    recording = RunningRecording(recording_writer(path), SESSION)
    for number in count():
        pixels = np.full((240, 320, 3), number % 256, np.uint8)
        recording.add_image(Image(pixels, timestamp_s=number / 60, sequence=number), {})
        os.write(writing, f"{number} {time.monotonic()}\n".encode())
        time.sleep(1 / 60)
    raise AssertionError


if __name__ == "__main__":
    main()
