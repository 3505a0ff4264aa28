"""The complete plugin contract.

A plugin is a module or object that an entry point in the group ``tactile_core.v1`` names. Each
hook takes no arguments and returns a mapping from a component's short name to ``"module:Class"``,
so that using one component imports only its module. Profiles and bundles refer to a component as
``plugin.name``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pluggy

GROUP = "tactile_core.v1"

hookspec = pluggy.HookspecMarker("tactile_core")
hookimpl = pluggy.HookimplMarker("tactile_core")


@hookspec
def tactile_cameras() -> Mapping[str, str]:
    """Cameras: ``{name: "module:Class"}`` of :class:`tactile_core.interfaces.camera.Camera`."""
    raise NotImplementedError


@hookspec
def tactile_illuminations() -> Mapping[str, str]:
    """Illuminations: subclasses of :class:`tactile_core.interfaces.illumination.Illumination`."""
    raise NotImplementedError


@hookspec
def tactile_light_drivers() -> Mapping[str, str]:
    """Light drivers: subclasses of :class:`tactile_core.interfaces.light_driver.LightDriver`."""
    raise NotImplementedError


@hookspec
def tactile_calibrators() -> Mapping[str, str]:
    """Calibrators: subclasses of :class:`tactile_core.interfaces.calibration.Calibrator`."""
    raise NotImplementedError


@hookspec
def tactile_artefacts() -> Mapping[str, str]:
    """Artefacts: subclasses of :class:`tactile_core.interfaces.artefact.Artefact`."""
    raise NotImplementedError


@hookspec
def tactile_estimators() -> Mapping[str, str]:
    """Estimators: subclasses of :class:`tactile_core.interfaces.estimator.Estimator`."""
    raise NotImplementedError


@hookspec
def tactile_sinks() -> Mapping[str, str]:
    """Sinks: subclasses of :class:`tactile_core.interfaces.sink.Sink`."""
    raise NotImplementedError


@hookspec
def tactile_recording_formats() -> Mapping[str, str]:
    """Recording formats, each named by the ending of its files: ``{"h5": "module:Class"}``.

    Subclasses of :class:`tactile_core.interfaces.recording_format.RecordingFormat`.
    """
    raise NotImplementedError


@hookspec
def tactile_simulators() -> Mapping[str, str]:
    """Simulators: subclasses of :class:`tactile_core.interfaces.simulator.Simulator`."""
    raise NotImplementedError


@hookspec
def tactile_importers() -> Mapping[str, str]:
    """Importers: subclasses of :class:`tactile_core.interfaces.importer.Importer`."""
    raise NotImplementedError


@hookspec
def tactile_clusters() -> Mapping[str, str]:
    """Clusters: subclasses of :class:`tactile_core.interfaces.cluster.Cluster`."""
    raise NotImplementedError


@hookspec
def tactile_commands() -> Mapping[str, str]:
    """Commands of ``tactile``: ``{"my-command": "module:function"}``.

    The function's annotations declare arguments and options as for typer, and its docstring is the
    help. It prints by :mod:`tactile_core.cli.output` and raises a ``TactileError`` on unusable
    input. ``tactile --help`` imports its module: import heavy modules in the function.
    """
    raise NotImplementedError


@hookspec
def tactile_profiles() -> Path:
    """Return the directory that holds the plugin's ``*.yaml`` profiles."""
    raise NotImplementedError
