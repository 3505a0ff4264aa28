"""Records two virtual fingers and a robot by LeRobot's own code, and reads them back by its own.

Runs in LeRobot's environment: python record_session.py TASK.json, which has "root", "seconds",
"fps", "videos", "cameras" (name to options of TactileCameraConfig) and "truth" (name to an .npz
with what each frame of the script shows, measured elsewhere). Prints one line of JSON.
"""

import json
import os
import sys
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch

if "+cpu" in torch.__version__:  # without these compiled operators torchvision is not imported
    for operator in ("nms", "qnms"):
        with suppress(RuntimeError):
            signature = "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor"
            torch.library.define(f"torchvision::{operator}", signature)

from lerobot.cameras import CameraConfig
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.robots import Robot, RobotConfig
from lerobot.utils.import_utils import register_third_party_plugins

try:  # since 0.6, in which heights are depth images
    from lerobot.configs.video import DepthEncoderConfig
    from lerobot.utils import feature_utils as features_of

    HAS_DEPTH = True
except ImportError:
    from lerobot.datasets import utils as features_of

    HAS_DEPTH = False

register_third_party_plugins()
from lerobot_camera_tactile import TactileObservations  # noqa: E402


@RobotConfig.register_subclass("small_gripper")
@dataclass(kw_only=True)
class SmallGripperConfig(RobotConfig):
    cameras: dict[str, CameraConfig] = field(default_factory=dict)


class SmallGripper(Robot):
    """One joint, which closes slowly, and cameras, read as LeRobot's own robots read them."""

    config_class = SmallGripperConfig
    name = "small_gripper"

    def __init__(self, config: SmallGripperConfig) -> None:
        super().__init__(config)
        self.cameras = make_cameras_from_configs(config.cameras)
        self.position = 0.0

    @property
    def observation_features(self) -> dict[str, Any]:
        found: dict[str, Any] = {"jaw.pos": float}
        for name, camera in self.cameras.items():
            found[name] = (camera.height, camera.width, 3)
            if camera.use_depth and HAS_DEPTH:
                found[f"{name}_depth"] = (camera.height, camera.width, 1)
        return found

    @property
    def action_features(self) -> dict[str, Any]:
        return {"jaw.pos": float}

    @property
    def is_connected(self) -> bool:
        return all(camera.is_connected for camera in self.cameras.values())

    def connect(self, calibrate: bool = True) -> None:
        for camera in self.cameras.values():
            camera.connect()

    @property
    def is_calibrated(self) -> bool:
        return True

    def calibrate(self) -> None: ...

    def configure(self) -> None: ...

    def get_observation(self) -> dict[str, Any]:
        found: dict[str, Any] = {"jaw.pos": self.position}
        for name, camera in self.cameras.items():
            found[name] = camera.read_latest(max_age_ms=60_000)
            if camera.use_depth:
                found[f"{name}_depth"] = camera.read_latest_depth(max_age_ms=60_000)
        return found

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        self.position = action["jaw.pos"]
        return action

    def disconnect(self) -> None:
        for camera in self.cameras.values():
            camera.disconnect()


class TouchingGripper(TactileObservations, SmallGripper):
    """The same with force, slip and contact."""


def record(task: dict[str, Any]) -> tuple[list[str], list[dict[str, int]], list[float]]:
    """Record an episode; return the names of the state, the frames shown, and their ages, ms."""
    configs = {
        name: CameraConfig.get_choice_class("tactile")(**options)
        for name, options in task["cameras"].items()
    }
    robot = TouchingGripper(SmallGripperConfig(id="test", cameras=configs))
    observed = features_of.hw_to_dataset_features(
        robot.observation_features, "observation", task["videos"]
    )
    if not HAS_DEPTH:
        for name, camera in robot.cameras.items():
            shape = (camera.height, camera.width)
            observed[f"observation.{name}_depth"] = {
                "dtype": "float32",
                "shape": shape,
                "names": None,
            }
    acted = features_of.hw_to_dataset_features(robot.action_features, "action", task["videos"])
    options: dict[str, Any] = {}
    if HAS_DEPTH:
        options["depth_encoder"] = DepthEncoderConfig(
            depth_min=-0.0005, depth_max=0.0035, use_log=False
        )
    dataset = LeRobotDataset.create(
        "local/touch",
        task["fps"],
        features=observed | acted,
        root=task["root"],
        robot_type=robot.name,
        use_videos=task["videos"],
        image_writer_threads=2,
        **options,
    )
    shown, ages_ms = [], []
    robot.connect()
    begin_s = time.monotonic()
    for number in range(round(task["seconds"] * task["fps"])):
        time.sleep(max(0.0, begin_s + number / task["fps"] - time.monotonic()))
        found = robot.get_observation()
        taken = {name: camera.observation for name, camera in robot.cameras.items()}
        shown.append({name: one.sequence for name, one in taken.items()})
        ages_ms += [1000 * (time.monotonic() - one.taken_s) for one in taken.values()]
        action = robot.send_action({"jaw.pos": number / 100})
        frame = features_of.build_dataset_frame(observed, found, "observation")
        if not HAS_DEPTH:
            for name in robot.cameras:
                frame[f"observation.{name}_depth"] = found[f"{name}_depth"][..., 0]
        frame |= features_of.build_dataset_frame(acted, action, "action")
        dataset.add_frame(frame | {"task": "hold"})
    robot.disconnect()
    dataset.save_episode()
    dataset.finalize()
    return observed["observation.state"]["names"], shown, ages_ms


def compare(task: dict[str, Any], names: list[str], shown: list[dict[str, int]]) -> dict[str, Any]:
    """Return the largest differences of what LeRobot loads from what was shown."""
    truth = {name: dict(np.load(path)) for name, path in task["truth"].items()}
    # the loader rounds depth from videos to whole millimetres unless it gives metres
    options = {"depth_output_unit": "m"} if HAS_DEPTH else {}
    dataset = LeRobotDataset("local/touch", root=task["root"], **options)
    worst = dict.fromkeys(("pixel_levels", "height_um", "number", "time_s", "state"), 0.0)
    deepest_mm = largest_n = 0.0

    def note(key: str, difference: Any) -> None:
        worst[key] = max(worst[key], float(np.max(np.abs(difference))))

    for index in range(len(dataset)):
        item = dataset[index]
        state = dict(zip(names, item["observation.state"].tolist(), strict=True))
        note("time_s", item["timestamp"].item() - index / task["fps"])
        note("state", state["jaw.pos"] - np.float32(max(index - 1, 0) / 100))
        for name, sequence in shown[index].items():
            true = {key: array[sequence] for key, array in truth[name].items()}
            pixels = item[f"observation.images.{name}"].numpy().transpose(1, 2, 0) * 255
            note("pixel_levels", np.rint(pixels) - true.pop("rgb"))
            depth = "observation.images." if HAS_DEPTH else "observation."
            height_mm = item[f"{depth}{name}_depth"].numpy().squeeze() * 1000
            deepest_mm = max(deepest_mm, float(height_mm.max()))
            note("height_um", 1000 * (height_mm - true.pop("height_mm")))
            for key, value in true.items():
                note("number", state[f"{name}.{key}"] - np.float32(value))
            largest_n = max(largest_n, state[f"{name}.fz_n"])
    policy = features_of.dataset_to_policy_features(dataset.meta.features)
    return {
        "frames": len(dataset),
        "different_frames": {n: len({one[n] for one in shown}) for n in truth},
        "worst": worst,
        "deepest_mm": deepest_mm,
        "largest_n": largest_n,
        "names": names,
        "policy_features": sorted(policy),
    }


task = json.loads(Path(sys.argv[1]).read_text())
try:
    names, shown, ages_ms = record(task)
    foreign = [name for name in ("cv2", "tactile_core") if name in sys.modules]
    found = compare(task, names, shown)
except Exception:
    traceback.print_exc()
    sys.stderr.flush()
    os._exit(1)  # LeRobot's writer of images would be waited for, forever
found |= {
    "lerobot": version("lerobot"),
    "age_ms": [float(np.median(ages_ms)), max(ages_ms)],
    "foreign": foreign,
}
print(json.dumps(found))
