"""Force by the shipped network on other units: ``python -m experiments.network_force``.

Presses the review's unseen objects on virtual units of the hexagonal fingertip that nothing was
trained or chosen on, through ``networks.force_cnn``. Prints R², coverage of the standard
deviations, in all and by fifths of them, and the processor time of the step.
"""

from __future__ import annotations

import argparse
from time import thread_time

import cv2
import numpy as np

from tactile_core.interfaces.estimator import SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Reference
from tactile_networks.steps import ForceNetwork
from tactile_train.samples import sample_size
from tactile_train.scores import force_scores
from tactile_train.virtual_forces import UNSEEN_OBJECTS, ForceUnit

REFERENCE_FRAMES = 8


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=21001)
    parser.add_argument("--units", type=int, default=4)
    parser.add_argument("--frames", type=int, default=125)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    design = load_profile("hex_fingertip", sim=True)
    options = ForceNetwork.Options(manifest="hex_fingertip_virtual")
    found, true, std, labels, outside, times_ms = [], [], [], [], [], []
    for number in range(given.first, given.first + given.units):
        unit = ForceUnit(design, number, sample_size(design))
        stage = unit.stage
        step = ForceNetwork(options, SensorContext(stage.profile.image, stage.profile.gel))
        step.open()
        stage.reset()
        frames = [stage.frame() for _ in range(REFERENCE_FRAMES)]
        pixels = np.asarray(np.mean([one.pixels for one in frames], 0), np.float32)
        reference = Reference(pixels, frames[0].channels)
        for sample in unit.samples(UNSEEN_OBJECTS, given.frames):
            frame = stage.frame()
            began_s = thread_time()
            wrench = step.estimate(frame, reference, None, None)
            times_ms.append(1e3 * (thread_time() - began_s))
            found.append(wrench.values)
            true.append(sample.wrench)
            std.append(wrench.std)
            labels.append(sample.label)
            outside.append(sample.outside)
    estimated, forces, sigma = np.array(found), np.array(true), np.array(std)
    print("R² of fx, fy, fz, tz; RMSE in N, N, N, N·mm")
    for one in force_scores(estimated, forces, labels, np.array(outside)):
        print(f"{one.of}: {one.samples} frames; {one.r2.round(3)}; {one.rmse.round(2)}")
    within = np.abs(estimated - forces) < sigma
    print(f"within one standard deviation: {within.mean(0).round(2)}; by fifths of it:")
    for column, name in enumerate(("fx", "fy", "fz", "tz")):
        fifths = np.array_split(np.argsort(sigma[:, column]), 5)
        print(name, [round(float(within[fifth, column].mean()), 2) for fifth in fifths])
    print(f"{np.median(times_ms):.1f} ms of processor time a frame")


if __name__ == "__main__":
    main()
