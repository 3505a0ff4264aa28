"""The score that grows with the presses: each is measured before it is learned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tactile_core.algorithms.circles import Circle
from tactile_core.calibration.guided.bench import Bench
from tactile_core.calibration.measured import measured_frames
from tactile_core.calibration.press_search import light_of, relocated
from tactile_core.calibration.presses import FoundPress, angles_deg
from tactile_core.errors import CalibrationError
from tactile_core.plugins.calibrators import fitted_by
from tactile_core.quantities import Frame


class PREQUENTIAL:
    """Parameters of the running score. Nothing sets them."""

    # [count] With fewer presses nothing is scored: the circles are found with a light that is
    # uniform. Source: the circle search (``LIGHT.few_presses``).
    fewest_presses = 4
    # [count] Latest presses whose mean error is the score. Source: by hand, : errors of single
    # presses differ by half.
    window = 6
    # [ratio] More presses help while the score falls by more than this share from one window to
    # the next. Source: by hand, : a third of the accuracy that guided calibration promises.
    helps = 0.05


class Scorer:
    """Measures each press with a calibration on those before it.

    Parameters
    ----------
    bench : Bench
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._presses: dict[str, FoundPress] = {}

    def score(self, kept: Mapping[str, Frame], before: Mapping[str, Circle]) -> float | None:
        """Return the mean error of the normals of the last press, degrees.

        As in a fold of ``tactile calibrate``, nothing depends on that press but its own circle,
        which is located by the light of the others.

        Parameters
        ----------
        kept : mapping of str to Frame
            Presses by name that are new since the last call, in order.
        before : mapping of str to Circle
            The presses before the last one, with the circles that were found without it.

        Returns
        -------
        float or None
            None with too few presses before it, or if they cannot be used.

        References
        ----------
        .. [1] A. P. Dawid, "Present Position and Potential Developments: Some Personal Views:
           Statistical Theory: The Prequential Approach", Journal of the Royal Statistical Society
           A 147(2), 1984.
        """
        for name, frame in kept.items():
            self._presses[name] = self._bench.prepared(name, frame)
        if len(before) < PREQUENTIAL.fewest_presses:
            return None
        press = self._presses[list(kept)[-1]]
        training = [replace(self._presses[name], circle=found) for name, found in before.items()]
        undeformed = self._bench.condition.undeformed
        try:
            located = relocated(press, light_of(training))
            samples = [one.training() for one in training]
            model = fitted_by(self._bench.calibrator, samples, undeformed)
        except CalibrationError:
            return None
        ((_, measured),) = measured_frames(model, [located], undeformed)
        rows, columns, true = located.true_gradients(located.scored())
        found = np.stack([measured.gx[rows, columns], measured.gy[rows, columns]], 1)
        return float(angles_deg(found, true).mean())


def score_of(errors_deg: Sequence[float]) -> float | None:
    """Return the mean of the latest errors; None without any."""
    latest = errors_deg[-PREQUENTIAL.window :]
    return float(np.mean(latest)) if len(latest) else None


def still_helps(errors_deg: Sequence[float]) -> bool:
    """Whether the score was still falling between the latest two windows."""
    window = PREQUENTIAL.window
    if len(errors_deg) < 2 * window:
        return True
    now, before = np.mean(errors_deg[-window:]), np.mean(errors_deg[-2 * window : -window])
    return bool(now < (1 - PREQUENTIAL.helps) * before)
