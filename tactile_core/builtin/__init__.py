"""The plugin ``core``: thin adapters over the algorithms, registered like a stranger's.

May import conditioning, recordings, interfaces and what these may import.
"""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    """Cameras of the core."""
    return {
        "folder": "tactile_core.builtin.cameras.folder_camera:FolderCamera",
        "replay": "tactile_core.builtin.sequential:ReplayCamera",
        "stream": "tactile_core.builtin.cameras.stream_camera:StreamCamera",
        "uvc": "tactile_core.builtin.cameras.uvc_camera:UvcCamera",
    }


@hookimpl
def tactile_illuminations() -> Mapping[str, str]:
    """Illuminations of the core."""
    return {
        "constant": "tactile_core.interfaces.illumination:ConstantIllumination",
        "sequential": "tactile_core.builtin.sequential:SequentialIllumination",
    }


@hookimpl
def tactile_light_drivers() -> Mapping[str, str]:
    """Light drivers of the core."""
    return {
        "serial_leds": "tactile_core.builtin.leds.serial_leds:SerialLeds",
        "usb_leds": "tactile_core.builtin.leds.usb_leds:UsbLeds",
        "uvc_leds": "tactile_core.builtin.leds.serial_leds:UvcLeds",
    }


@hookimpl
def tactile_calibrators() -> Mapping[str, str]:
    """Calibrators of the core."""
    return {
        "automatic": "tactile_core.builtin.mlp:AutomaticCalibrator",
        "lookup_table": "tactile_core.builtin.lookup_table:LookupTableCalibrator",
        "mlp": "tactile_core.builtin.mlp:MlpCalibrator",
        "polynomial": "tactile_core.builtin.lookup_table:PolynomialCalibrator",
    }


@hookimpl
def tactile_artefacts() -> Mapping[str, str]:
    """What a calibration fits."""
    return {
        "gel_stiffness": "tactile_core.builtin.force_elastic:GelStiffness",
        "linear_force": "tactile_core.builtin.force_linear:LinearForceModel",
        "lookup_table": "tactile_core.builtin.lookup_table:LookupTable",
        "mlp": "tactile_core.builtin.mlp:Mlp",
        "polynomial": "tactile_core.builtin.lookup_table:Polynomial",
        "slope_errors": "tactile_core.interfaces.calibration:SlopeErrors",
    }


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Estimators of the core."""
    return {
        "contact_loss": "tactile_core.builtin.imprint_motion:LossOfContact",
        "contact": "tactile_core.builtin.contact:Contact",
        "contact_shear": "tactile_core.builtin.optical_flow:ShearOfContact",
        "displacement": "tactile_core.builtin.contact:Displacement",
        "force_elastic": "tactile_core.builtin.force_elastic:ElasticForce",
        "force_linear": "tactile_core.builtin.force_linear:LinearForce",
        "friction": "tactile_core.builtin.imprint_motion:FrictionEstimator",
        "imprint_motion": "tactile_core.builtin.imprint_motion:MotionOfImprint",
        "load": "tactile_core.builtin.contact:Load",
        "markers": "tactile_core.builtin.contact:MarkerDetection",
        "optical_flow": "tactile_core.builtin.optical_flow:OpticalFlow",
        "poisson": "tactile_core.builtin.poisson:Poisson",
        "robust_poisson": "tactile_core.builtin.poisson:RobustPoisson",
        "slip": "tactile_core.builtin.slip:Slip",
        "slip_contact": "tactile_core.builtin.slip_contact:SlipContactFinder",
        "marker_tracking": "tactile_core.builtin.contact:MarkerTracking",
    }


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Sinks of the core."""
    return {
        "npz": "tactile_core.builtin.result_files:Arrays",
        "tmd": "tactile_core.builtin.result_files:Heights",
        "png": "tactile_core.builtin.result_files:Pictures",
        "ply": "tactile_core.builtin.result_files:Mesh",
        "record": "tactile_core.builtin.result_files:Record",
    }
