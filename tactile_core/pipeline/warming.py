"""Loads and compiles what a live sensor needs before its camera is opened."""

from __future__ import annotations

from contextlib import suppress
from time import perf_counter, thread_time

from tactile_core.bundles.bundle import Bundle
from tactile_core.errors import TactileError
from tactile_core.pipeline.made_up_frames import made_up_reference
from tactile_core.pipeline.pipeline import COMPILING_S, Pipeline
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Reference


def warm_up(
    profile: Profile, bundle: Bundle | None, reference: Reference | None, *, first: bool
) -> tuple[str, ...]:
    """Measure made-up frames as the sensor will measure its own, and return notes for the user.

    Parameters
    ----------
    profile : Profile
    bundle : Bundle or None
    reference : Reference or None
        As far as it is known.
    first : bool
        Whether the reference will be the camera's first frame.
    """
    start_s, start_of_thread_s = perf_counter(), thread_time()
    with suppress(TactileError):  # reported when the devices are open
        pipeline = Pipeline(profile, bundle, reference)
        if first and pipeline.reference is None:
            made_up = made_up_reference(profile.image, pipeline.channels)
            pipeline = pipeline.with_reference(made_up)
        pipeline.warm()
    took_s = perf_counter() - start_s
    if thread_time() - start_of_thread_s < COMPILING_S:
        return ()
    return (
        f"opening took {took_s:.0f} s longer, because the extra 'fast' compiled its kernels; this "
        f"happens once per installation",
    )
