"""Recordings and readings in HDF5, for tactile-core; written from finished recordings."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_recording_formats() -> Mapping[str, str]:
    """Return the format of ``.h5`` files."""
    return {"h5": "tactile_hdf5.recordings:Hdf5"}
