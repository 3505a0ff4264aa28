"""What a recording holds of its sensor."""

from __future__ import annotations

from datetime import UTC, datetime

from tactile_core.interfaces.component import VIRTUAL_CAMERA
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.plugins.entry_points import library_versions
from tactile_core.recordings.recorder import RecordedSession
from tactile_core.recordings.session_files import bundle_content, profile_text


# Packages of which results depend on the version.
def session_of(
    pipeline: Pipeline, *, sensor: str, exposures: int, gel: str | None, tared: bool
) -> RecordedSession:
    """Return what a recording holds of a sensor.

    Parameters
    ----------
    pipeline : Pipeline
    sensor : str
        Name of the sensor, for people.
    exposures : int
        Images of one observation.
    gel : str or None
    tared : bool
        Whether a load is being subtracted already.
    """
    bundle = pipeline.bundle
    named = gel or (None if bundle is None else bundle.manifest.gel_id) or None
    return RecordedSession(
        profile=profile_text(pipeline.profile),
        sensor=sensor,
        channels=pipeline.channels,
        exposures=exposures,
        sim=pipeline.profile.camera.use == VIRTUAL_CAMERA,
        serial=pipeline.serial,
        gel=named,
        bundle=None if bundle is None else bundle_content(bundle),
        reference=pipeline.given_reference,
        software=library_versions(),
        started=datetime.now(UTC).isoformat(timespec="milliseconds"),
        tared=tared,
    )
