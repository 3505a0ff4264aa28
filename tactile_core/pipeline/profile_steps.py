"""Builds the chain of a profile's steps."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.pipeline.chain import Chain, without_markers
from tactile_core.plugins.blame import blame
from tactile_core.plugins.options import options_of
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, Gradients, HeightMap, Quantity, Reference

# Quantities that can come with a calibrated unit's frame; some calibrations return height.
_EVER_GIVEN: frozenset[type[Quantity]] = frozenset({Frame, Reference, Gradients, HeightMap})


def check_steps(profile: Profile) -> None:
    """Check that the steps of a profile form a chain, and that the profile gives what they need.

    Raises
    ------
    PluginError, ProfileError, InputError
        As for a :class:`Pipeline` of this profile.
    """
    context = SensorContext(profile.image, profile.gel)
    chain_of(profile, made_steps(profile, context))


def made_steps(profile: Profile, context: SensorContext) -> dict[str, Estimator]:
    """Return the estimators of a profile by their names."""
    steps = {}
    for name, component in profile.estimators.items():
        kind = resolve("estimator", component.use)
        with blame(f"step {name!r}", kind):
            steps[name] = kind(options_of(kind, component), context)
    return steps


def chain_of(profile: Profile, steps: Mapping[str, Estimator]) -> tuple[Chain, list[str]]:
    """Return the chain, and the names of the steps left out because the gel has no markers."""
    markless = without_markers(steps) if profile.gel.markers is None else []
    chain = Chain({name: step for name, step in steps.items() if name not in markless})
    chain.check(_EVER_GIVEN)
    return chain, markless
