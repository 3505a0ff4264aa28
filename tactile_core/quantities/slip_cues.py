"""Evidence of slip: the contact, the shear of its surface, and the imprint of the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from tactile_core.algorithms.arrays.types import Bool
from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.layers import Layer, Outline
from tactile_core.quantities.quantity import Quantity

ContactSource = Literal["height", "image", "motion"]
MotionKind = Literal["translation", "rotation"]


@dataclass(frozen=True, eq=False)
class SlipContact(Quantity):
    """Contact area in which slip is measured, and the load on it.

    Attributes
    ----------
    mask : (H, W) bool
        The contact, in blocks of pixels; empty without contact.
    area, depth : float
        The load, in any unit; either may grow alone, and is 0 if it is not measured.
    source : str
        What shows the contact: ``height`` (the height map or its contact area), ``image`` (the
        change of light) or ``motion`` (the surface that is sheared furthest).
    absolute : bool
        Whether the reference shows the undeformed surface, so that the load is known.
    """

    mask: Annotated[Bool, FieldSpec(axes=("y", "x"), saved_as="slip_contact")]
    area: float
    depth: float
    source: ContactSource
    absolute: bool
    timestamp_s: TimestampS = 0.0

    @property
    def known(self) -> bool:
        """Whether the contact or its load is measured, not only inferred from motion."""
        return self.source == "height" or self.absolute

    def layers(self) -> tuple[Layer, ...]:
        """Return the outline of the contact."""
        return (Outline(self.mask, "contact for slip"),)


@dataclass(frozen=True, eq=False)
class ContactShear(Quantity):
    """Shear of the gel surface in contact since the load settled, and the share that sticks.

    Attributes
    ----------
    usable : bool
        Whether the displacement field was measured; if not, the other values say nothing.
    degree, degree_std : float
        Degree of slip of the field, the share of the contact that slips, and its standard
        deviation.
    stick_share : float
        Share of the contact that moved with its stick region recently.
    motion_mm, rotation_mm : float
        RMS over the contact of the rigid motion of the stick region, and of its rotation alone.
    rotation_deg, entropy_bits : float or None
        Rotation of the stick region, positive from x towards y, and entropy of the magnitude of the
        displacement [1]_; None without contact.
    restarted : bool
        The load grew with this frame, so that the shear is measured from here.
    deceleration : float
        0 while the stick region moves at its peak speed, 1 when it has stopped.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    usable: bool
    degree: float = 0.0
    stick_share: float = 1.0
    motion_mm: Annotated[float, FieldSpec("mm")] = 0.0
    rotation_mm: Annotated[float, FieldSpec("mm")] = 0.0
    rotation_deg: Annotated[float | None, FieldSpec("deg")] = None
    entropy_bits: Annotated[float | None, FieldSpec("bit")] = None
    restarted: bool = False
    degree_std: Annotated[float, FieldSpec(std_of="degree")] = 0.0
    deceleration: float = 0.0
    timestamp_s: TimestampS = 0.0

    @property
    def kind(self) -> MotionKind:
        """Whether the surface rather turned or shifted."""
        return "rotation" if 2 * self.rotation_mm**2 > self.motion_mm**2 else "translation"


@dataclass(frozen=True, eq=False)
class ImprintMotion(Quantity):
    """Motion of the object's imprint relative to the gel surface.

    Attributes
    ----------
    tracked : bool
        Whether enough markers were seen to follow the surface; if not, the other values say
        nothing.
    changed : float
        Share of the imprint's energy that changed in about the last second although neither a rigid
        motion nor the shear of the surface explains it.
    moved : float
        Distance of about the last second, relative to the largest that elastic deformation and
        uncertainty explain.
    distance_mm, distance_std_mm : float
        RMS motion of the imprint relative to the surface since the contact settled, and its
        standard deviation.
    turned_deg : float
        Rotation of the last second, positive from x towards y.
    kind : str
        ``translation`` or ``rotation``, whichever moved the imprint further.
    strength : float
        RMS of the imprint relative to the light.
    """

    tracked: bool
    changed: float = 0.0
    moved: float = 0.0
    distance_mm: Annotated[float, FieldSpec("mm")] = 0.0
    distance_std_mm: Annotated[float, FieldSpec("mm", std_of="distance_mm")] = 0.0
    turned_deg: Annotated[float, FieldSpec("deg")] = 0.0
    kind: MotionKind = "translation"
    strength: float = 0.0
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class ShearRelease(Quantity):
    """How far the gel surface sprang back from its largest recent shear.

    Attributes
    ----------
    shear_mm : float
        RMS displacement of the markers that are seen.
    released : float
        Share of the largest shear that was released, from 0 to 1.
    """

    shear_mm: Annotated[float, FieldSpec("mm")]
    released: float
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class ContactLoss(Quantity):
    """How much of a contact is lost, compared with the strength at which it settled.

    Attributes
    ----------
    measured : bool
        Whether it can be measured: markers on a square lattice are seen, and the imprint is
        tracked; if not, the other values say nothing.
    strength : float
        Strength of the contact, from 0 without contact; 1 is the weakest that is distinguished from
        none.
    settled : float
        Strength at which the contact settled in the last seconds; below 1 no contact did.
    lost : float
        Share of the contact that may be lost: near 0 while a strong contact is as strong as it
        settled, 1 when it is lost. A weak contact can hardly be distinguished from none, so this is
        1/3 for one of strength 1 even if nothing is lost.
    """

    measured: bool
    strength: float = 0.0
    settled: float = 0.0
    lost: float = 0.0
    timestamp_s: TimestampS = 0.0
