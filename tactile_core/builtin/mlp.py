"""``core.mlp``, and ``core.automatic``, which chooses a model by the number of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.arrays.regression import PolynomialFit
from tactile_core.algorithms.slopes.network import Networks, train
from tactile_core.builtin.lookup_table import PolynomialCalibrator, PolynomialOptions, fit_curve
from tactile_core.interfaces.calibration import Calibration, Calibrator, Press
from tactile_core.interfaces.slope_models.model_file import Arrays
from tactile_core.interfaces.slope_models.samples import (
    SlopeOptions,
    baked,
    samples_of,
    scale_of,
    shape_of,
)
from tactile_core.interfaces.slope_models.slope_model import SlopeCalibration, SlopeModel
from tactile_core.quantities import Float32, Reference

_PREFIX = "polynomial_"  # Of the names of the polynomial's arrays


class MlpOptions(SlopeOptions):
    """Options of ``core.mlp``."""

    members: int = Field(default=2, ge=1, le=16, description="Number of networks to average.")
    width: int = Field(default=20, ge=2, le=256, description="Units per hidden layer.")
    layers: int = Field(default=3, ge=1, le=6, description="Number of hidden layers.")
    epochs: int = Field(default=60, ge=1, description="Passes over the samples.")
    noise: float = Field(
        default=0.05,
        ge=0,
        description="Noise on the features in training, in their standard deviations.",
    )
    gain_noise: float = Field(
        default=0.01,
        ge=0,
        lt=0.5,
        description="Noise on the common brightness of all lights in training, as a share of it.",
    )
    polynomial_share: float = Field(
        default=0.5,
        ge=0,
        lt=1,
        description="Weight of a polynomial (as of core.polynomial) in the mean with the networks. "
        "It continues a trend beyond the calibrated slopes, where networks level off.",
    )
    seed: int = Field(default=0, ge=0, description="The same seed gives the same model.")


@dataclass(frozen=True, eq=False)
class Ensemble:
    """The mean of networks, averaged with a polynomial.

    Attributes
    ----------
    networks : Networks
    polynomial : PolynomialFit or None
    share : float
        Weight of the polynomial; the networks have the rest.
    """

    networks: Networks
    polynomial: PolynomialFit | None = None
    share: float = 0.0

    def __call__(self, features: Float32) -> Float32:
        """Map (N, K + 2) features to the (N, 2) components of unit normals."""
        mean = self.networks(features)
        if self.polynomial is None:
            return mean
        share = np.float32(self.share)
        return (1 - share) * mean + share * self.polynomial(features)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all weights and biases, and the scale of the features."""
        networks = self.networks
        arrays: dict[str, NDArray[Any]] = {
            "members": np.array(len(networks.layers[0])),
            "mean": networks.mean,
            "std": networks.std,
        }
        if self.polynomial is not None:
            named = {_PREFIX + name: array for name, array in self.polynomial.arrays().items()}
            arrays |= {"share": np.array(self.share), **named}
        for depth, layer in enumerate(networks.layers):
            for m, one in enumerate(layer):
                arrays |= {f"weight_{m}_{depth}": one[:-1], f"bias_{m}_{depth}": one[-1]}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> Self:
        """Rebuild the networks from :meth:`arrays`."""
        members = range(int(arrays["members"]))
        depths = sum(name.startswith("weight_0_") for name in arrays)
        layers = []
        for depth in range(depths):
            parts = [(arrays[f"weight_{m}_{depth}"], arrays[f"bias_{m}_{depth}"]) for m in members]
            layers.append(np.stack([np.vstack(part) for part in parts]))
        networks = Networks(arrays["mean"], arrays["std"], layers)
        if "share" not in arrays:
            return cls(networks)
        named = {name.removeprefix(_PREFIX): arrays[name] for name in arrays if _PREFIX in name}
        return cls(networks, PolynomialFit.from_arrays(named), float(arrays["share"]))


class Mlp(SlopeCalibration):
    """Calibration with fitted networks and a polynomial."""

    function = Ensemble


class MlpCalibrator(Calibrator):
    """Trains small networks and a polynomial, the best model from about eight presses on.

    Networks follow the light best and level off beyond the calibrated slopes; a polynomial does the
    opposite. Their errors differ, so that the mean is better than either [1]_.

    References
    ----------
    .. [1] A. Krogh and J. Vedelsby, "Neural network ensembles, cross validation, and active
       learning", NIPS, 1995.
    """

    Options: ClassVar[type[BaseModel]] = MlpOptions
    options: MlpOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> Mlp:
        """Fit on presses of a known ball; takes about a second."""
        options, blur_px = self.options, self.smoothing_px(scale_of(presses))
        features, normal_xy = samples_of(presses, reference, blur_px=blur_px)
        seen = _with_gain_noise(features, options.gain_noise, options.seed)
        networks = train(
            seen,
            normal_xy,
            hidden=(options.width,) * options.layers,
            epochs=options.epochs,
            noise=options.noise,
            seeds=range(options.seed, options.seed + options.members),
        )
        share = options.polynomial_share
        curve = fit_curve(seen, normal_xy) if share else None
        function = Ensemble(networks, curve, share)
        table = baked(function, features, presses, reference, blur_px)
        return Mlp(SlopeModel(function, shape_of(reference), blur_px, table))

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing set by the options."""
        return self.options.smoothing_px(mm_per_px)


def _with_gain_noise(features: Float32, gain_noise: float, seed: int) -> Float32:
    """Scale the intensities of each sample by a random gain, the same for all lights."""
    rng = np.random.default_rng(seed)
    gain = 1 + gain_noise * rng.standard_normal((len(features), 1), dtype=np.float32)
    ratio = (features[:, :-2] + 1) * np.asarray(gain, np.float32)
    return np.concatenate([ratio - 1, features[:, -2:]], axis=1)


class AutomaticOptions(SlopeOptions):
    """Options of ``core.automatic``."""

    presses_for_network: int = Field(
        default=8,
        ge=1,
        description="Fewest presses for core.mlp; with fewer, core.polynomial is fitted.",
    )


class AutomaticCalibrator(Calibrator):
    """Fits ``core.polynomial`` or ``core.mlp``, depending on the number of presses.

    On recordings of two sensors, a network and a quadratic have equal errors with eight presses.
    With sixteen presses the error of the network is smaller by a sixth, with four it is larger by
    half.
    """

    Options: ClassVar[type[BaseModel]] = AutomaticOptions
    options: AutomaticOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
        """Fit ``core.polynomial`` or ``core.mlp``."""
        blur = self.options.model_dump(include=set(SlopeOptions.model_fields), exclude_unset=True)
        if len(presses) < self.options.presses_for_network:
            return PolynomialCalibrator(PolynomialOptions(**blur)).fit(presses, reference)
        return MlpCalibrator(MlpOptions(**blur)).fit(presses, reference)

    def smoothing_px(self, mm_per_px: float) -> float:
        """Smoothing set by the options."""
        return self.options.smoothing_px(mm_per_px)
