"""What a recording holds of its sensor."""

from __future__ import annotations

from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version

from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.recordings.recorder import RecordedSession
from tactile_core.recordings.session_files import bundle_content, profile_text

VIRTUAL = "core.virtual"  # The camera of every virtual sensor

# Packages of which results depend on the version.
_PACKAGES = ("tactile-core", "numpy", "opencv-contrib-python-headless", "scipy")


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
        sim=pipeline.profile.camera.use == VIRTUAL,
        serial=pipeline.serial,
        gel=named,
        bundle=None if bundle is None else bundle_content(bundle),
        reference=pipeline.given_reference,
        software={name: found for name in _PACKAGES if (found := _version(name)) is not None},
        started=datetime.now(UTC).isoformat(timespec="milliseconds"),
        tared=tared,
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
