"""Workers of a dask scheduler measure recordings, for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_clusters() -> Mapping[str, str]:
    """Return the cluster."""
    return {"dask": "tactile_cluster.dask_cluster:DaskCluster"}
