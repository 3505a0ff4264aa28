"""The estimator interface: from quantities of a frame to others; estimators of fitted force."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import BaseModel

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Float32, Quantity

Q = TypeVar("Q", bound=Quantity)

EXTERNAL = "external"
# An input that the caller supplies with each frame: `Pipeline.process(frame, pose)`.
External = Annotated[Q, EXTERNAL]


@dataclass(frozen=True)
class SensorContext:
    """The properties of the sensor build that a step can use.

    What belongs to one unit or session, such as the reference, comes with each frame: a step
    declares it as an annotated argument.

    Attributes
    ----------
    image : ImageSection
        Size and scale of the image in which all quantities are defined.
    gel : Gel
        Thickness, stiffness, coating and markers, as far as the profile gives them.
    """

    image: ImageSection
    gel: Gel

    @cached_property
    def rest_mm(self) -> Float32 | None:
        """(H, W) z in mm of the undeformed gel surface, 0 at the apex; None if it is flat."""
        if self.gel.radius_mm is None:
            return None
        # only domes need it
        from tactile_core.algorithms.heights.sphere import rest_height

        image = self.image
        return rest_height(
            (image.height_px, image.width_px),
            mm_per_px=image.mm_per_px,
            radius_mm=self.gel.radius_mm,
        )


class Estimator(ABC):
    """One step of the chain.

    A subclass defines ``estimate``. The annotations of its arguments and return value declare the
    step's inputs and output; ``X | None`` declares an optional input::

        class Contact(Estimator):
            def estimate(self, height: HeightMap) -> ContactMask: ...

    A model that was fitted to the unit, and that its bundle holds, is an argument like any other:
    a class that is both an artefact and a quantity. Without it, the step is left out.

    A step with several results returns a tuple and declares it: ``-> tuple[A, B]``. An input from
    outside the pipeline is annotated ``External[RobotPose]``.
    """

    Options: ClassVar[type[BaseModel]] = Options
    stateful: bool = False
    """True if a result depends on earlier frames (tracking, slip); such steps never run in
    parallel workers. A class sets it, or an object for which that depends on its options."""
    needs_markers: ClassVar[bool] = False
    """True for a step that needs printed markers: it is skipped, with a note, if the profile sets
    ``gel.markers: null``."""

    estimate: Any

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        self.options = options
        self.context = context

    def open(self) -> None:  # noqa: B027  (optional hook)
        """Acquire resources, such as a network session, before the first frame.

        The constructor stays cheap, so that a profile can be checked quickly. Resources that are
        acquired here need not be picklable. Before a live camera is opened, a copy of the step is
        opened, measures a few made-up frames and is closed.
        """

    def close(self) -> None:  # noqa: B027
        """Release what :meth:`open` acquired; the step can be opened again."""

    def reset(self) -> None:  # noqa: B027  (optional hook)
        """Forget all earlier frames."""

    def resume(self) -> None:
        """Continue after a gap in the frames, such as an unplugged camera.

        What depends on the frame before is forgotten; a tare stays if possible. The default resets
        a step that is ``stateful``, and so forgets its tare.
        """
        if self.stateful:
            self.reset()

    def tare(self, result: Any) -> Any:
        """Subtract the load of this frame from all later results, until :meth:`reset`.

        Called once, after :meth:`estimate` of the frame; earlier steps have been tared already.
        Override it in a step that estimates a load.

        Parameters
        ----------
        result : Quantity
            Return value of ``estimate``.

        Returns
        -------
        Quantity
            The same result with zero load.
        """
        return result


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

    noun: ClassVar[str] = "force model"
    command: ClassVar[str] = "calibrate-force"

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
    fewest_sequences : int
        Number that :meth:`fit` needs. With 1 it returns what is known before from none, which the
        score of a single one takes.
    feature_names : tuple of str
        Names of the features. With ``shift_x`` and ``shift_y``, the mean displacement in mm, the
        axes of the load cell are compared with the image's, and with ``moment``, that of the
        displacement about the image centre, their torque axes.
    """

    artefact: ClassVar[str] = "force"
    fewest_sequences: ClassVar[int] = 2
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
