"""Guided calibration, played by a virtual hand: ``python benchmarks/guided_calibration.py``.

A hand with noise presses a ball where guided calibration asks, and every fifth press is bad in one
of nine ways (``experiments/virtual_hand.py``). Prints one row for each rig and seed: presses that
the hand made, good and bad ones that were kept and refused; the held-out error of guided
calibration, and of ``tactile calibrate`` on image files of the presses that were kept; and the
error against the simulator's truth on separate presses, also of a calibration on as many good
presses at random places.

Seeds below 200 served to choose thresholds.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

import numpy as np

from experiments.virtual_hand import VirtualHand
from tactile_core.acquisition.acquisition import average
from tactile_core.calibration.fitting import calibrate, calibrate_presses
from tactile_core.calibration.guided.session import GuidedCalibration
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.result import Calibrated
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import Frame, Gradients, Reference
from tactile_sim.simulation import write_frame

RIGS = ("hex_fingertip", "baxter_fingertip", "desktop_six_led")
MOST_ATTEMPTS = 40
"""A hand that is led for longer gives up."""


@dataclass(frozen=True)
class Played:
    """One guided session.

    Attributes
    ----------
    attempts : int
        Presses that the hand made.
    good_kept, good_refused, bad_kept, bad_refused : int
    wrong : tuple of str
        Good presses that were refused, and bad ones that were kept, each with the reason.
    feed_ms : float
        Median time of ``feed`` for frames without an examination.
    """

    attempts: int
    good_kept: int
    good_refused: int
    bad_kept: int
    bad_refused: int
    wrong: tuple[str, ...]
    feed_ms: float


def play(hand: VirtualHand, guided: GuidedCalibration, *, most: int = MOST_ATTEMPTS) -> Played:
    """Follow the guidance until it is done."""
    by_stamp: dict[float, int] = {}
    reasons: dict[int, str] = {}
    times = []
    for frame in hand.idle(5):
        guidance = guided.feed(frame)
    while not guidance.done and len(hand.attempts) < most:
        assert guidance.target_px is not None
        share = guidance.target_radius_px / hand.ball_radius_px
        for frame in hand.press(guidance.target_px, share):
            number = len(hand.attempts) - 1
            by_stamp[frame.timestamp_s] = number
            before = process_time()
            guidance = guided.feed(frame)
            times.append(process_time() - before)
            if guidance.refused:
                reasons[number] = guidance.refused
    kept = [by_stamp[frame.timestamp_s] for frame in guided.presses.values()]
    counts = {(bad, held): 0 for bad in (False, True) for held in (False, True)}
    wrong = []
    for attempt in hand.attempts:
        bad = attempt.bad not in ("", "double")  # the first half of a double press is good
        held = attempt.number in kept
        counts[bad, held] += 1
        # a double press that is refused is no loss
        if bad == held and not (attempt.bad == "double" and not held):
            reason = reasons.get(attempt.number, "kept" if held else "withdrawn")
            wrong.append(f"{attempt.bad or 'good'} {attempt.contact_share:.2f}: {reason}")
    # a second frame of one touch would be a bad press, too
    twice = len(kept) - len(set(kept))
    return Played(
        len(hand.attempts),
        counts[False, True],
        counts[False, False],
        counts[True, True] + twice,
        counts[True, False],
        tuple(wrong),
        1e3 * float(np.median(times)),
    )


def unguided(hand: VirtualHand, count: int, seed: int) -> dict[str, Frame]:
    """Take as many good presses at random places, as somebody who presses without being led."""
    presses = hand.truth_presses(count, seed, whole=True)
    return {f"{number}": frame for number, (frame, _, _) in enumerate(presses)}


def truth_error_deg(hand: VirtualHand, result: Calibrated, count: int, seed: int) -> float:
    """Return the mean error of normals in the contacts of separate presses, against the truth."""
    pipeline = Pipeline(hand.profile, result.bundle)
    errors = []
    for frame, true, contact in hand.truth_presses(count, seed):
        measured = pipeline.process(frame).get(Gradients)
        slopes = np.stack([measured.x, measured.y], -1)
        errors.append(angles_deg(slopes[contact], true[contact]).mean())
    return float(np.mean(errors))


def by_files(
    hand: VirtualHand, frames: Sequence[Frame], reference: Reference, folder: Path
) -> Calibrated:
    """Calibrate from image files of the same presses, as ``tactile calibrate`` does."""
    for number, frame in enumerate(frames):
        write_frame(folder / "presses", frame, f"{number:02d}")
    undeformed = replace(
        reference.as_frame(hand.mm_per_px), exposure_times_s=frames[0].exposure_times_s
    )
    write_frame(folder / "reference", undeformed, "reference")
    return calibrate(
        hand.profile,
        folder / "presses",
        folder / "reference",
        ball_diameter_mm=2 * hand.ball_mm,
    )


def row(rig: str, seed: int, overrides: dict[str, Any] | None, truths: int) -> str:
    """Play one session, and return its row of the table."""
    began = perf_counter()
    hand = VirtualHand(rig, seed, overrides)
    reference = average(list(hand.idle(10)))
    guided = GuidedCalibration(hand.profile, reference, 2 * hand.ball_mm, at_once=True)
    played = play(hand, guided)
    for words in played.wrong:
        print(f"    {words}", flush=True)
    counts = (
        f"{rig:18} {seed:4} {played.attempts:6} {played.good_kept:5} {played.good_refused:5} "
        f"{played.bad_kept:5} {played.bad_refused:5} "
    )
    if not truths:
        return f"{counts} {perf_counter() - began:6.0f} s"
    frames = list(guided.presses.values())
    result = guided.finish()
    with TemporaryDirectory(prefix="guided-calibration-") as name:
        same = by_files(hand, frames, reference, Path(name))
    others = calibrate_presses(
        hand.profile,
        unguided(hand, len(frames), seed),
        reference,
        ball_diameter_mm=2 * hand.ball_mm,
        scored=False,
    )
    scores = [0.0 if one.score is None else one.score.mean_deg for one in (result, same)]
    truth = [truth_error_deg(hand, one, truths, seed) for one in (result, others)]
    return (
        f"{counts}{scores[0]:8.2f}° {scores[1]:6.2f}° {truth[0]:8.2f}° {truth[1]:6.2f}° "
        f"{played.feed_ms:6.1f} ms {perf_counter() - began:6.0f} s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", action="append", help="a profile; the papers' rigs by default")
    parser.add_argument("--seeds", type=int, nargs="+", default=[200, 201, 202])
    parser.add_argument(
        "--truths",
        type=int,
        default=12,
        help="separate presses for the truth; 0 only counts presses",
    )
    parser.add_argument("--half", action="store_true", help="images of half the size: faster")
    options = parser.parse_args()
    print(f"{'':18} {'':4} {'':6} {'good':>11} {'bad':>11} {'held-out':>16} {'truth':>17}")
    print(
        f"{'rig':18} {'seed':4} {'made':>6} {'kept':>5} {'not':>5} {'kept':>5} {'not':>5} "
        f"{'guided':>8} {'files':>7} {'guided':>9} {'random':>7} {'feed':>9}",
        flush=True,
    )
    for seed in options.seeds:
        for rig in options.rig or RIGS:
            overrides = halved(rig) if options.half else None
            print(row(rig, seed, overrides, options.truths), flush=True)


def halved(rig: str) -> dict[str, Any]:
    """Return the overrides that halve both sides of a rig's images."""
    from tactile_core.profiles.loader import load_profile

    image = load_profile(rig).image
    return {
        "image": {
            "width_px": image.width_px // 2,
            "height_px": image.height_px // 2,
            "mm_per_px": 2 * image.mm_per_px,
        }
    }


if __name__ == "__main__":
    main()
