"""Calibrations that other programs made, for tactile-core, and one of ours for simulators."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_importers() -> Mapping[str, str]:
    """Return the importers, each named after the program whose files it reads."""
    return {
        "gs_sdk": "tactile_imports.colour_network:AngleNetworkImporter",
        "gsrobotics": "tactile_imports.colour_network:NormalNetworkImporter",
        "taxim": "tactile_imports.polynomial_lookup:TaximImporter",
        "taxim_rgb": "tactile_imports.polynomial_lookup:TaximRgbImporter",
        "touchnet": "tactile_imports.touch_network:TouchNetworkImporter",
        "touchnet_bgr": "tactile_imports.touch_network:TouchNetworkBgrImporter",
        "gelsight_heightmap": "tactile_imports.bin_table:BinTableImporter",
    }


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """Return the models that a bundle holds after an import."""
    return {
        "angle_network": "tactile_imports.colour_network:AngleNetwork",
        "normal_network": "tactile_imports.colour_network:NormalNetwork",
        "polynomial_lookup": "tactile_imports.polynomial_lookup:PolynomialLookup",
        "touch_network": "tactile_imports.touch_network:TouchNetwork",
        "bin_table": "tactile_imports.bin_table:BinTable",
    }


@hookimpl
def tactile_commands() -> Mapping[str, str]:
    """Return the command that writes a calibration for another program."""
    return {"export": "tactile_imports.commands:export"}
