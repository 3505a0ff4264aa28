"""The estimator interface: one typed step from quantities to a quantity."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import BaseModel

from tactile_core.algorithms.dome import rest_height
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.gel import Gel
from tactile_core.interfaces.image import ImageSection
from tactile_core.quantities import Float32, Quantity

Q = TypeVar("Q", bound=Quantity)

EXTERNAL = "external"
External = Annotated[Q, EXTERNAL]
"""An input of a step that the caller gives with each frame: ``Pipeline.process(frame, pose)``."""


@dataclass(frozen=True)
class SensorContext:
    """What a step may know of the sensor build that it works for.

    What belongs to one unit or one session, such as the reference, comes with each frame: a step
    takes it by annotation.

    Attributes
    ----------
    image : ImageSection
        Size and scale of the image in which every quantity lives.
    gel : Gel
        Thickness, stiffness, coating and markers, as far as the profile gives them.
    compiled : bool
        Whether the pipeline uses compiled loops, for a step that has some.
    """

    image: ImageSection
    gel: Gel
    compiled: bool = False

    @cached_property
    def rest_mm(self) -> Float32 | None:
        """(H, W) z of the untouched skin in the sensor frame, 0 at the apex; None if flat."""
        if self.gel.radius_mm is None:
            return None
        image = self.image
        return rest_height(
            (image.height_px, image.width_px),
            mm_per_px=image.mm_per_px,
            radius_mm=self.gel.radius_mm,
        )


class Estimator(ABC):
    """One step of the chain.

    A subclass defines ``estimate``; the annotations of its arguments and of its return value
    *are* the declaration of what it takes and gives, and ``X | None`` marks an input that may be
    missing::

        class Contact(Estimator):
            def estimate(self, height: HeightMap) -> ContactMask: ...

    A step with several results returns a tuple of them, and says so: ``-> tuple[A, B]``. What
    comes from outside with each frame is annotated ``External[RobotPose]``.
    """

    Options: ClassVar[type[BaseModel]] = Options
    stateful: ClassVar[bool] = False
    """True for tracking and slip: readings depend on those before, so the steps are never split
    over workers."""
    needs_markers: ClassVar[bool] = False
    """True for a step that makes sense only where markers are printed on the gel: it is left out,
    with a note, where a revision says ``gel.markers: null``."""

    estimate: Any

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        self.options = options
        self.context = context

    def open(self) -> None:  # noqa: B027  (only steps that hold something have it to acquire)
        """Acquire what is needed to work, such as a session of a network; before the first frame.

        The constructor stays cheap, so that a profile can be checked without it, and what is
        acquired here need not pickle.
        """

    def close(self) -> None:  # noqa: B027
        """Release what :meth:`open` acquired; it may be opened again."""

    def reset(self) -> None:  # noqa: B027  (only stateful steps have something to forget)
        """Forget everything about earlier frames."""

    def tare(self, result: Any) -> Any:
        """Take the load of a frame for zero from now on, until :meth:`reset`.

        Called once after :meth:`estimate` of that frame; what comes from the steps before is at
        zero already. Only a step that estimates a load has one to subtract.

        Parameters
        ----------
        result : Quantity
            What ``estimate`` returned.

        Returns
        -------
        Quantity
            The same with its load at zero.
        """
        return result
