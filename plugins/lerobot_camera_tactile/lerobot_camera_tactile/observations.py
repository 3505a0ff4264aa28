"""Force, slip and contact as observations of a robot."""

from __future__ import annotations

from typing import Any

from lerobot_camera_tactile.camera import TactileCamera


class TactileObservations:
    """Adds what a robot's tactile cameras measure to its observations; the first of its bases.

    Each number is named after the camera, such as ``left.fz_n``: ``fx_n``, ``fy_n``, ``fz_n`` (N)
    and ``tz_nmm`` (N·mm) of the wrench, ``slip_degree`` (0 to 1) with ``slip_known`` (1, or 0 where
    the state is unknown), and ``contact_area_mm2``. There are those that the profile measures; what
    one frame lacks is NaN. They belong to the image of the same observation.

    Attributes
    ----------
    cameras : dict of str to Camera
        The robot's.
    """

    cameras: dict[str, Any]

    @property
    def observation_features(self) -> dict[str, Any]:
        """Those of the robot, and the numbers of its tactile cameras as floats."""
        added = {key: float for key, _, _ in self._numbers()}
        return {**super().observation_features, **added}  # type: ignore[misc]

    def get_observation(self) -> dict[str, Any]:
        """Return that of the robot, with the numbers of its tactile cameras."""
        found = super().get_observation()  # type: ignore[misc]
        added = {
            key: camera.observation.numbers.get(name, float("nan"))
            for key, camera, name in self._numbers()
        }
        return {**found, **added}

    def _numbers(self) -> list[tuple[str, TactileCamera, str]]:
        return [
            (f"{key}.{name}", camera, name)
            for key, camera in self.cameras.items()
            if isinstance(camera, TactileCamera)
            for name in camera.number_names
        ]
