"""A plugin as an object, so that one package holds many."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from tactile_core.interfaces.hookspecs import hookimpl


class Hooks:
    """Registers a class of cameras, lights, …, formats or simulators, or a command, as ``x``.

    One of another module is named with it, ``"loud_formats:Folders"``. A model of
    ``calibrations`` comes with its calibrator, unless another one is named.
    """

    def __init__(
        self,
        *,
        cameras: str = "",
        lights: str = "",
        drivers: str = "",
        calibrations: str = "",
        calibrator: str = "",
        estimators: str = "",
        sinks: str = "",
        formats: str = "",
        simulators: str = "",
        commands: str = "",
        profiles: str = "",
    ) -> None:
        self._cameras = _listed("cameras", cameras)
        self._lights = _listed("lights", lights)
        self._drivers = _listed("drivers", drivers)
        self._artefacts = _listed("calibrations", calibrations)
        calibrator = calibrator or (calibrations and f"{calibrations}Calibrator")
        self._calibrators = _listed("calibrations", calibrator)
        self._estimators = _listed("estimators", estimators)
        self._sinks = _listed("sinks", sinks)
        self._formats = _listed("formats", formats)
        self._simulators = _listed("simulators", simulators)
        self._commands = _listed("commands", commands)
        self._profiles = profiles

    @hookimpl
    def tactile_cameras(self) -> dict[str, str]:
        return self._cameras

    @hookimpl
    def tactile_illuminations(self) -> dict[str, str]:
        return self._lights

    @hookimpl
    def tactile_light_drivers(self) -> dict[str, str]:
        return self._drivers

    @hookimpl
    def tactile_calibrators(self) -> dict[str, str]:
        return self._calibrators

    @hookimpl
    def tactile_artefacts(self) -> dict[str, str]:
        return self._artefacts

    @hookimpl
    def tactile_estimators(self) -> dict[str, str]:
        return self._estimators

    @hookimpl
    def tactile_sinks(self) -> dict[str, str]:
        return self._sinks

    @hookimpl
    def tactile_recording_formats(self) -> dict[str, str]:
        return self._formats

    @hookimpl
    def tactile_simulators(self) -> dict[str, str]:
        return self._simulators

    @hookimpl
    def tactile_commands(self) -> dict[str, str]:
        return self._commands

    @hookimpl
    def tactile_profiles(self) -> Path | None:
        folder = Path(__file__).parent / "profiles" / self._profiles
        return folder if self._profiles else None


class Misspelt:
    @hookimpl
    def tactile_sensors(self) -> dict[str, str]:
        return {}


class Listing:
    @hookimpl
    def tactile_estimators(self) -> list[str]:
        return ["fake_faulty.estimators:Sound"]


def _listed(module: str, name: str) -> dict[str, str]:
    value = name if ":" in name else f"{module}:{name}"
    return {"x": f"fake_faulty.{value}"} if name else {}


nothing = SimpleNamespace()
misspelt, listing = Misspelt(), Listing()
no_folder = Hooks(profiles="nowhere")
no_class = Hooks(estimators="Nonexistent")
wrong_interface = Hooks(cameras="DRIVER")
