"""Computes the inputs of an estimator with other estimators."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from tactile_core.interfaces.estimator import SensorContext
from tactile_core.pipeline.chain import Step, declared_step
from tactile_core.quantities import Quantity
from tactile_core.testing.registered import Registered

KnownQuantities = Mapping[type[Quantity], Quantity]


def completed(
    known: KnownQuantities,
    needs: Collection[type[Quantity]],
    registered: Registered,
    context: SensorContext,
    *,
    without: str,
) -> dict[type[Quantity], Quantity]:
    """Add the missing quantities, computed by estimators of the plugin or of the core.

    Parameters
    ----------
    known : mapping of type to Quantity
    needs : collection of types
    registered : Registered
    context : SensorContext
        The sensor of the quantities.
    without : str
        The estimator under test, which is not used.
    """
    made = dict(known)
    if made.keys() >= set(needs):
        return made
    steps = list(_steps(registered, context, without))
    while step := next((s for s in steps if _is_useful(s, made)), None):
        steps.remove(step)
        try:
            step.estimator.open()
            made.update(zip(step.gives, step.estimate(made), strict=True))
        except Exception:  # its own checks report it
            continue
    return made


def _is_useful(step: Step, made: Mapping[type[Quantity], Quantity]) -> bool:
    return not made.keys() >= set(step.gives) and step.missing(made) is None


def _steps(registered: Registered, context: SensorContext, without: str) -> Iterator[Step]:
    for source in (registered, Registered("core", {})):
        for part in source.estimators():
            try:
                if part.use != without:
                    yield declared_step(part.use, source.make(part, context))
            except Exception:  # its own checks report it
                continue
