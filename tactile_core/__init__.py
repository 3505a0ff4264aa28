"""A plugin framework for optical tactile sensors of the GelSight family.

The public names below are imported on first use, so that ``import tactile_core`` is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactile_core.acquisition.device_list import DeviceList as DeviceList
    from tactile_core.acquisition.device_list import ListedDevice as ListedDevice
    from tactile_core.acquisition.device_list import list_devices as list_devices
    from tactile_core.acquisition.unit_devices import claim_device as claim_device
    from tactile_core.acquisition.unit_devices import forget_devices as forget_devices
    from tactile_core.bundles.bundle import Bundle as Bundle
    from tactile_core.bundles.claims import Claim as Claim
    from tactile_core.bundles.claims import Claims as Claims
    from tactile_core.bundles.claims import read_claims as read_claims
    from tactile_core.errors import CalibrationError as CalibrationError
    from tactile_core.errors import DeviceError as DeviceError
    from tactile_core.errors import InputError as InputError
    from tactile_core.errors import PluginError as PluginError
    from tactile_core.errors import ProfileError as ProfileError
    from tactile_core.errors import TactileError as TactileError
    from tactile_core.interfaces.artefact import Artefact as Artefact
    from tactile_core.interfaces.calibration import Calibration as Calibration
    from tactile_core.interfaces.calibrator import Calibrator as Calibrator
    from tactile_core.interfaces.calibrator import Press as Press
    from tactile_core.interfaces.camera import Camera as Camera
    from tactile_core.interfaces.camera import Trigger as Trigger
    from tactile_core.interfaces.connected_device import ConnectedDevice as ConnectedDevice
    from tactile_core.interfaces.estimator import Estimator as Estimator
    from tactile_core.interfaces.estimator import External as External
    from tactile_core.interfaces.estimator import SensorContext as SensorContext
    from tactile_core.interfaces.force_calibration import FittedForce as FittedForce
    from tactile_core.interfaces.force_calibration import ForceModel as ForceModel
    from tactile_core.interfaces.force_calibration import ForceSamples as ForceSamples
    from tactile_core.interfaces.illumination import Exposure as Exposure
    from tactile_core.interfaces.illumination import Illumination as Illumination
    from tactile_core.interfaces.illumination import Light as Light
    from tactile_core.interfaces.light_driver import LightDriver as LightDriver
    from tactile_core.interfaces.reading import Reading as Reading
    from tactile_core.interfaces.sink import Session as Session
    from tactile_core.interfaces.sink import Sink as Sink
    from tactile_core.interfaces.slope_models.options import SlopeOptions as SlopeOptions
    from tactile_core.interfaces.slope_models.slope_calibration import (
        SlopeCalibration as SlopeCalibration,
    )
    from tactile_core.interfaces.slope_models.slope_model import SlopeModel as SlopeModel
    from tactile_core.interfaces.stream_statistics import StreamStatistics as StreamStatistics
    from tactile_core.interfaces.streaming.encoded_image import TornImage as TornImage
    from tactile_core.interfaces.streaming.image_reader import ImageSource as ImageSource
    from tactile_core.interfaces.streaming.streaming_camera import (
        StreamingCamera as StreamingCamera,
    )
    from tactile_core.pipeline.batch.batch import Batch as Batch
    from tactile_core.pipeline.batch.recording_job import MeasuredRecording as MeasuredRecording
    from tactile_core.pipeline.health import Health as Health
    from tactile_core.pipeline.opening import open_sensor as open_sensor
    from tactile_core.pipeline.pipeline import Pipeline as Pipeline
    from tactile_core.pipeline.sensor import Sensor as Sensor
    from tactile_core.pipeline.sensor_group import SensorGroup as SensorGroup
    from tactile_core.pipeline.sinks import Sinks as Sinks
    from tactile_core.profiles.loader import load_profile as load_profile
    from tactile_core.quantities import ContactMask as ContactMask
    from tactile_core.quantities import ContactStress as ContactStress
    from tactile_core.quantities import DisplacementField as DisplacementField
    from tactile_core.quantities import FieldSpec as FieldSpec
    from tactile_core.quantities import Frame as Frame
    from tactile_core.quantities import Friction as Friction
    from tactile_core.quantities import Gradients as Gradients
    from tactile_core.quantities import HeightMap as HeightMap
    from tactile_core.quantities import Image as Image
    from tactile_core.quantities import MarkerDetections as MarkerDetections
    from tactile_core.quantities import MarkerField as MarkerField
    from tactile_core.quantities import NetworkOutput as NetworkOutput
    from tactile_core.quantities import Quantity as Quantity
    from tactile_core.quantities import Reference as Reference
    from tactile_core.quantities import RelativeLoad as RelativeLoad
    from tactile_core.quantities import ShownGel as ShownGel
    from tactile_core.quantities import SlipState as SlipState
    from tactile_core.quantities import Wrench as Wrench

__version__ = "0.1.0"

_HOMES = {
    "acquisition.device_list": ("DeviceList", "ListedDevice", "list_devices"),
    "acquisition.unit_devices": ("claim_device", "forget_devices"),
    "bundles.bundle": ("Bundle",),
    "bundles.claims": ("Claim", "Claims", "read_claims"),
    "interfaces.connected_device": ("ConnectedDevice",),
    "interfaces.artefact": ("Artefact",),
    "interfaces.calibration": ("Calibration",),
    "interfaces.calibrator": ("Calibrator", "Press"),
    "interfaces.camera": ("Camera", "Trigger"),
    "errors": (
        "CalibrationError",
        "DeviceError",
        "InputError",
        "PluginError",
        "ProfileError",
        "TactileError",
    ),
    "interfaces.estimator": ("Estimator", "External", "SensorContext"),
    "interfaces.force_calibration": ("FittedForce", "ForceModel", "ForceSamples"),
    "interfaces.illumination": ("Exposure", "Illumination", "Light"),
    "interfaces.light_driver": ("LightDriver",),
    "interfaces.reading": ("Reading",),
    "interfaces.sink": ("Session", "Sink"),
    "interfaces.slope_models.options": ("SlopeOptions",),
    "interfaces.slope_models.slope_calibration": ("SlopeCalibration",),
    "interfaces.slope_models.slope_model": ("SlopeModel",),
    "interfaces.stream_statistics": ("StreamStatistics",),
    "interfaces.streaming.encoded_image": ("TornImage",),
    "interfaces.streaming.image_reader": ("ImageSource",),
    "interfaces.streaming.streaming_camera": ("StreamingCamera",),
    "pipeline.batch.batch": ("Batch",),
    "pipeline.batch.recording_job": ("MeasuredRecording",),
    "pipeline.health": ("Health",),
    "pipeline.pipeline": ("Pipeline",),
    "profiles.loader": ("load_profile",),
    "quantities": (
        "ContactMask",
        "ContactStress",
        "DisplacementField",
        "FieldSpec",
        "Frame",
        "Friction",
        "Gradients",
        "HeightMap",
        "Image",
        "MarkerDetections",
        "MarkerField",
        "NetworkOutput",
        "Quantity",
        "Reference",
        "RelativeLoad",
        "ShownGel",
        "SlipState",
        "Wrench",
    ),
    "pipeline.opening": ("open_sensor",),
    "pipeline.sensor": ("Sensor",),
    "pipeline.sensor_group": ("SensorGroup",),
    "pipeline.sinks": ("Sinks",),
}
_MODULE_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [*_MODULE_OF, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'tactile_core' has no attribute {name!r}")
    try:
        return getattr(import_module(f"tactile_core.{_MODULE_OF[name]}"), name)
    except (ImportError, AttributeError) as error:
        from tactile_core.plugins.opencv import opencv_fault_behind

        fault = opencv_fault_behind(error)
        if fault:
            raise ImportError(fault) from error
        raise


def __dir__() -> list[str]:
    return sorted(__all__)
