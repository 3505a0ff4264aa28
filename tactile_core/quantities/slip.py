"""Slip: the state of a contact, its degree, its cues, and the friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import (
    FieldSpec,
    Layer,
    MmPerPx,
    Outline,
    ScalarMap,
    TimestampS,
    VectorMap,
)
from tactile_core.quantities.quantity import Quantity

SlipName = Literal["none", "stick", "incipient", "slip", "unknown"]
SlipKind = Literal["translation", "rotation"]


@dataclass(frozen=True, eq=False)
class SlipState(Quantity):
    """Slip state of the contact.

    Attributes
    ----------
    state : str
        ``none`` (no contact), ``stick``, ``incipient`` (the border of the contact slips), ``slip``
        (gross slip of the entire contact) or ``unknown`` (neither markers nor optical flow show the
        motion of the surface, the load is not known and no contact has settled yet, or the frames
        show no motion that can be followed: see ``reason``).
    degree : float
        Share of the contact that slips, or the evidence of it from the imprint: 0 if the entire
        contact sticks, 1 if all of it slips. Where the load is not known and the loss of contact is
        measured, the share of the contact that may be lost. 0 where nothing is measured. While
        markers cannot be followed, the degree is that of what is found of them.
    kind : str or None
        ``translation`` or ``rotation`` during slip; None otherwise.
    entropy_bits : float or None
        Entropy of the displacement magnitude in the contact area, with bins of 1/256 mm [1]_; None
        without contact.
    rotation_deg : float or None
        Rotation of the gel surface in contact, in degrees, positive from x towards y.
    onset_s : float or None
        Time at which the current incipient or gross slip began.
    distance_mm, distance_std_mm : float or None
        Distance by which the object moved over the gel surface since the contact settled, and its
        standard deviation; None if no imprint is tracked.

    reason : str
        Why the state is unknown; empty otherwise.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of Shear and Slip with a
       GelSight Tactile Sensor", ICRA, 2015.
    """

    state: Annotated[SlipName, FieldSpec(saved_as="slip_state")]
    degree: Annotated[float, FieldSpec(saved_as="slip_degree")]
    kind: Annotated[SlipKind | None, FieldSpec(saved_as="slip_kind")] = None
    entropy_bits: Annotated[
        float | None, FieldSpec("bit", saved_as="slip_entropy_bits", if_none=0.0)
    ] = None
    rotation_deg: Annotated[
        float | None, FieldSpec("deg", saved_as="rotation_deg", if_none=0.0)
    ] = None
    onset_s: Annotated[float | None, FieldSpec("s", saved_as="slip_onset_s")] = None
    distance_mm: Annotated[float | None, FieldSpec("mm", saved_as="slip_distance_mm")] = None
    distance_std_mm: Annotated[
        float | None, FieldSpec("mm", saved_as="slip_distance_std_mm", std_of="distance_mm")
    ] = None
    timestamp_s: TimestampS = 0.0
    reason: Annotated[str, FieldSpec(saved_as="slip_reason")] = ""

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``slip``; a step that knows the force fills in the last two values."""
        return {
            "slip": {
                "state": self.state,
                "degree": self.degree,
                "kind": self.kind,
                "entropy_bits": self.entropy_bits,
                "rotation_deg": self.rotation_deg,
                "onset_s": self.onset_s,
                "distance_mm": self.distance_mm,
                "distance_std_mm": self.distance_std_mm,
                "margin": None,
                "friction": None,
                "reason": self.reason,
            }
        }


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
    stick_share : float
        Share of the contact that moved with its stick region recently.
    motion_mm, rotation_mm : float
        RMS over the contact of the rigid motion of the stick region, and of its rotation alone.
    rotation_deg, entropy_bits : float or None
        Rotation of the stick region, positive from x towards y, and entropy of the magnitude of the
        displacement [1]_; None without contact.
    restarted : bool
        The load grew with this frame, so that the shear is measured from here.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    usable: bool
    stick_share: float = 1.0
    motion_mm: Annotated[float, FieldSpec("mm")] = 0.0
    rotation_mm: Annotated[float, FieldSpec("mm")] = 0.0
    rotation_deg: Annotated[float | None, FieldSpec("deg")] = None
    entropy_bits: Annotated[float | None, FieldSpec("bit")] = None
    restarted: bool = False
    timestamp_s: TimestampS = 0.0

    @property
    def degree(self) -> float:
        """Share of the contact that slips."""
        return 1 - self.stick_share

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


@dataclass(frozen=True, eq=False)
class Friction(Quantity):
    """Friction of the contact, and how close it is to slipping.

    Attributes
    ----------
    coefficient : float or None
        Coefficient of friction: measured once the contact has slipped, before that the profile's;
        None without contact, and before slip if the profile gives none.
    coefficient_std : float or None
        Its standard deviation; None unless it is measured.
    margin : float or None
        Share of the greatest shear force that acts, ‖Ft‖ ⁄ (µ Fn): 0 without shear, 1 when the
        contact slips; None if the coefficient is not known.
    """

    coefficient: Annotated[float | None, FieldSpec(saved_as="friction")] = None
    coefficient_std: Annotated[
        float | None, FieldSpec(saved_as="friction_std", std_of="friction")
    ] = None
    margin: Annotated[float | None, FieldSpec(saved_as="slip_margin")] = None
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """Return ``friction`` and ``margin`` of the entry ``slip``."""
        return {"slip": {"friction": self.coefficient, "margin": self.margin}}


@dataclass(frozen=True, eq=False)
class ContactStress(Quantity):
    """Normal and shear stress that the object puts on the gel surface, N/mm².

    Their integrals over the image are the forces of :class:`Wrench`.

    Attributes
    ----------
    pressure_cells_mpa : (h, w) float32
        Positive in compression; 0 out of contact. One value per cell; cells of equal size tile the
        image.
    shear_cells_mpa : (h, w, 2) float32
        Shear stress along x and y: positive where the surface is sheared towards +x, +y.
    contact : (H, W) bool
        Where the object touches.
    """

    pressure_cells_mpa: Annotated[
        Float32, FieldSpec("MPa", ("y", "x"), saved_as="pressure_mpa", coarse=True)
    ]
    shear_cells_mpa: Annotated[
        Float32, FieldSpec("MPa", ("y", "x", "xy"), saved_as="shear_stress_mpa", coarse=True)
    ]
    contact: Annotated[Bool, FieldSpec(axes=("y", "x"), saved_as="stress_contact")]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0

    @property
    def pressure_mpa(self) -> Float32:
        """(H, W) float32 pressure at every pixel."""
        return np.asarray(self.full("pressure_cells_mpa"), np.float32)

    @property
    def shear_mpa(self) -> Float32:
        """(H, W, 2) float32 shear stress at every pixel."""
        return np.asarray(self.full("shear_cells_mpa"), np.float32)

    def layers(self) -> tuple[Layer, ...]:
        """Return the maps of pressure and of shear stress."""
        return (
            ScalarMap(self.pressure_mpa, "MPa", "pressure"),
            VectorMap(self.shear_mpa, None, "MPa", "shear stress"),
        )
