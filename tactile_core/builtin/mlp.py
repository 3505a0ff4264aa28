"""``core.mlp``: slopes by a few small networks on the colours and the place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.algorithms.network import Network, train
from tactile_core.builtin.image_shape import shape_of
from tactile_core.builtin.model_file import Arrays
from tactile_core.builtin.slope_calibration import SlopeCalibration, SlopeOptions
from tactile_core.builtin.slope_training import baked, blur_of, samples_of
from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Float32, Reference


class MlpOptions(SlopeOptions):
    """Options of ``core.mlp``."""

    members: int = Field(default=2, ge=1, le=16, description="Networks that are averaged.")
    width: int = Field(default=24, ge=2, le=256, description="Units per hidden layer.")
    layers: int = Field(default=3, ge=1, le=6, description="Hidden layers.")
    epochs: int = Field(default=60, ge=1, description="Passes over the samples.")
    noise: float = Field(default=0.05, ge=0, description="Noise on scaled features in training.")
    gain_noise: float = Field(
        default=0.01,
        ge=0,
        lt=0.5,
        description="Noise on the brightness of all lights in training, as a share of it.",
    )
    seed: int = Field(default=0, ge=0, description="Same seed, same model.")


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Networks whose outputs are averaged."""

    members: tuple[Network, ...]

    def __call__(self, features: Float32) -> Float32:
        """Map (N, K + 2) features to (N, 2) sines."""
        total = self.members[0](features)
        for member in self.members[1:]:
            total += member(features)
        return total / np.float32(len(self.members))


class Mlp(SlopeCalibration):
    """Small networks, the most accurate from about eight presses on."""

    USE: ClassVar[str] = "core.mlp"
    Options: ClassVar[type[BaseModel]] = MlpOptions
    _model: Ensemble

    @classmethod
    def fit(cls, samples: Sequence[Press], reference: Reference, options: BaseModel) -> Mlp:
        """Fit on presses of a known ball; takes a second or two."""
        assert isinstance(options, MlpOptions)
        blur_px = blur_of(options, samples)
        features, sines = samples_of(samples, reference, blur_px=blur_px)
        seen = _flickering(features, options.gain_noise, options.seed)
        members = [
            train(
                seen,
                sines,
                hidden=(options.width,) * options.layers,
                epochs=options.epochs,
                noise=options.noise,
                seed=options.seed + member,
            )
            for member in range(options.members)
        ]
        model = Ensemble(tuple(members))
        table = baked(model, features, samples, reference, blur_px)
        return cls(model, table, shape_of(reference), blur_px)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        members = self._model.members
        arrays: dict[str, NDArray[Any]] = {
            "members": np.array(len(members)),
            "mean": members[0].mean,
            "std": members[0].std,
        }
        for m, member in enumerate(members):
            for depth, (weight, bias) in enumerate(member.layers):
                arrays |= {f"weight_{m}_{depth}": weight, f"bias_{m}_{depth}": bias}
        return arrays

    @classmethod
    def _model_from(cls, arrays: Arrays, table: ColourTable | None) -> Ensemble:
        members = []
        for m in range(int(arrays["members"])):
            depths = sum(name.startswith(f"weight_{m}_") for name in arrays)
            layers = tuple(
                (arrays[f"weight_{m}_{d}"], arrays[f"bias_{m}_{d}"]) for d in range(depths)
            )
            members.append(Network(arrays["mean"], arrays["std"], layers))
        return Ensemble(tuple(members))


def _flickering(features: Float32, gain_noise: float, seed: int) -> Float32:
    """Features of samples that are each lit a little brighter or darker by all lamps alike."""
    rng = np.random.default_rng(seed)
    gain = 1 + gain_noise * rng.standard_normal((len(features), 1), dtype=np.float32)
    ratio = (features[:, :-2] + 1) * np.asarray(gain, np.float32)
    return np.concatenate([ratio - 1, features[:, -2:]], axis=1)
