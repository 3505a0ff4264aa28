"""Tactile sensors as cameras of LeRobot, whose discovery imports this package.

LeRobot's process imports neither OpenCV nor tactile-core from here: the sensor is opened and
measured in a process of its own, see :mod:`lerobot_camera_tactile.sensor_process`.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    from lerobot.cameras.camera import Camera as _Camera
except ImportError:
    _Camera = None

if not hasattr(_Camera, "read_latest"):
    try:
        _found = f"LeRobot {version('lerobot')} is installed"
    except PackageNotFoundError:
        _found = "LeRobot is not installed"
    raise ImportError(
        f"tactile cameras need LeRobot 0.4.4 or newer, whose cameras have read_latest, but "
        f"{_found}; run: pip install 'lerobot>=0.4.4'"
    )

from lerobot_camera_tactile.camera import TactileCamera
from lerobot_camera_tactile.configuration import TactileCameraConfig
from lerobot_camera_tactile.observations import TactileObservations

__all__ = ["TactileCamera", "TactileCameraConfig", "TactileObservations"]
