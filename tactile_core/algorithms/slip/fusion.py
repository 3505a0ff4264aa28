"""Fusion of the evidence of slip into one degree."""

from __future__ import annotations


class FUSION:
    """Parameters of the fusion."""

    # [share of the imprint's energy] Unexplained change of the imprint at which the object slips,
    # default of an option of ``core.slip``. Source: recorded lifts, each object by the others
    # (``benchmarks/slip_lift_folds.py``).
    imprint_changed = 0.04
    # [ratio] A change counts by this factor more if all of the shear was released meanwhile.
    # Source: chosen on recorded lifts; 2 to 4 rank them equally well.
    release_gain = 3.0
    # [ratio] Weight of the field's degree where neither the contact nor the load is known, so
    # that it stays below the degree of an imprint that slips. Source: by hand, : the field ranks
    # recorded lifts wrongly there (ADR 29).
    unknown_contact_weight = 0.2


def imprint_evidence(
    changed: float, moved: float, released: float, limit: float, *, alone: bool = True
) -> float:
    """Return the evidence of gross slip from the imprint; from 1 on the object slips.

    Parameters
    ----------
    changed, moved : float
        Unexplained change, and distance relative to what else explains it
        (:class:`~tactile_core.algorithms.slip.imprint_tracker.ImprintChange`).
    released : float
        Share of the shear that was released: a surface that springs back under an imprint that
        changes has lost the object.
    limit : float
        Change at which the object slips without a release of shear.
    alone : bool
        Whether a change without a release of shear is evidence. On a smooth object that is sheared
        far, only the light changes.
    """
    gain = FUSION.release_gain * released + (1.0 if alone else 0.0)
    return max(changed * gain / limit, moved)


def degree_of(evidence: float) -> float:
    """Convert evidence, 0 or more, to a degree: 0.5 where slip begins, below 1."""
    return evidence / (1 + evidence)
