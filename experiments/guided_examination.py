"""What guided calibration keeps of the ball presses of real sensors.

``python experiments/guided_examination.py DATA``, with the folder of real recordings. The presses
of each sensor are examined one after the other, as if they came from a live session.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

from experiments.press_sets import SETS, Presses
from tactile_core import open_sensor
from tactile_core.calibration.guided.examination import Examiner, TouchBench
from tactile_core.profiles.loader import load_profile


def main() -> None:
    data = Path(sys.argv[1])
    for presses in SETS:
        examined(presses, data / presses.folder)


def examined(presses: Presses, folder: Path) -> None:
    """Print how many presses are kept, and why the others are not."""
    profile = load_profile(presses.profile)
    with open_sensor(profile, input=folder / presses.reference, reference="first") as sensor:
        sensor.read()
        reference = sensor.pipeline.reference
    assert reference is not None
    examiner = Examiner(TouchBench.for_sensor(profile, reference, presses.ball_mm))
    reasons: Counter[str] = Counter()
    paths = sorted(folder.glob(presses.pattern))
    for path in paths:
        with open_sensor(profile, input=path, reference=reference) as sensor:
            frame = sensor.acquire()
        assert frame is not None
        verdict = examiner.examine(path.stem, frame)
        reasons.update(why for why in (verdict.why, *verdict.withdrawn.values()) if why)
    print(f"{presses.name}: {len(examiner.kept)} of {len(paths)} kept", flush=True)
    for why, count in reasons.items():
        print(f"    {count}: {why}")


if __name__ == "__main__":
    main()
