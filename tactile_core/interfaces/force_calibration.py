"""Steps whose force model is fitted to readings and measured forces."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import Quantity

COMPONENTS = ("fx_n", "fy_n", "fz_n", "tz_nmm")  # The components of a force, in the order of values


@dataclass(frozen=True, eq=False)
class ForceSamples:
    """Readings and measured forces of one sequence, such as one press.

    Attributes
    ----------
    name : str
    features : (N, K) float64
        What :meth:`FittedForce.features` returned for each frame.
    forces : (N, 4) float64
        fx, fy, fz in N and tz in N·mm, with the axes and signs of :class:`tactile_core.Wrench`;
        NaN where a component was not measured.
    """

    name: str
    features: Float64
    forces: Float64


class ForceModel(Quantity, Artefact):
    """A model that a bundle holds and that the pipeline gives to its step with each frame."""

    @abstractmethod
    def forces(self, features: Float64) -> tuple[Float64, Float64]:
        """Predict forces from features.

        Parameters
        ----------
        features : (N, K) float64

        Returns
        -------
        forces, std : (N, 4) float64
            Forces as in :class:`ForceSamples`, and their standard deviations; NaN for a component
            that was not fitted.

        Raises
        ------
        InputError
            A feature that the model uses is missing.
        """


class FittedForce(Estimator):
    """A step that ``tactile calibrate-force`` fits to a unit.

    ``estimate`` takes the model as one of its arguments. Without it, the step is left out::

        class MyForce(FittedForce):
            def estimate(self, model: MyModel, height: HeightMap) -> Wrench: ...
            def features(self, height: HeightMap) -> Float64: ...
            def fit(self, sequences: Sequence[ForceSamples]) -> MyModel: ...

    Attributes
    ----------
    artefact : str
        Name of the model in the bundle.
    feature_names : tuple of str
        Names of the features. With ``shift_x`` and ``shift_y``, the mean displacement in mm, the
        axes of the load cell are compared with the image's, and with ``moment``, that of the
        displacement about the image centre, their torque axes.
    """

    artefact: ClassVar[str] = "force"
    feature_names: ClassVar[tuple[str, ...]] = ()

    features: Any
    """Method that reduces one frame to (K,) float64: it takes what ``estimate`` takes, in the same
    order, without the model."""

    @abstractmethod
    def fit(self, sequences: Sequence[ForceSamples]) -> ForceModel:
        """Fit a model; the result is deterministic.

        Whatever the fit chooses, it chooses by these sequences alone: the score of a model is
        measured on others.

        Raises
        ------
        CalibrationError
            The sequences do not determine the model.
        """
