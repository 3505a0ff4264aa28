"""Prints what a tactile camera does in LeRobot's environment, right and wrong, as a line of JSON.

Runs as: python use_wrongly.py TASK.json, which has "python", "profile" and "bundle" of a virtual
sensor, and "no_height", a profile without that step.
"""

import json
import os
import signal
import sys
import time
from pathlib import Path

import draccus
import numpy as np
from lerobot.cameras import CameraConfig
from lerobot.cameras.utils import make_cameras_from_configs

from lerobot_camera_tactile import TactileCamera, TactileCameraConfig

task = json.loads(Path(sys.argv[1]).read_text())
said = {}
given = {key: task[key] for key in ("python", "profile", "bundle")} | {"sim": True}


def sentence(work, *words, **options):
    """Return the type and the words of the exception that work raises."""
    try:
        work(*words, **options)
    except Exception as error:
        return [type(error).__name__, str(error)]
    return ["", ""]


def make(**options):
    return TactileCamera(TactileCameraConfig(**(given | options)))


def open_bad_script():
    camera = make(script="absent.yaml")
    try:
        camera.connect()
    finally:
        said["left_open"] = camera.is_connected


said |= {
    "no_height": sentence(make, profile=task["no_height"], bundle=None, use_depth=True),
    "other_size": sentence(make, width=32, height=24),
    "no_interpreter": sentence(make, python="/absent/python"),
    "no_core": sentence(make, python="/bin/false"),
    "bad_script": sentence(open_bad_script),
}
config = TactileCameraConfig(**given, warmup_s=0.0, use_depth=True)
camera = make_cameras_from_configs({"touch": config})["touch"]
words = {"type": "tactile", "profile": "tactip", "python": "there/bin/python", "fps": 15}
decoded = draccus.decode(CameraConfig, words)  # as of LeRobot's command line
said["decoded"] = [type(decoded).__name__, decoded.python, decoded.fps, decoded.use_depth]
said["unconnected"] = sentence(camera.read_latest)
camera.connect()
said["twice"] = sentence(camera.connect)
image, depth_m = camera.async_read(timeout_ms=5000), camera.read_latest_depth(5000)
same = camera.observation
said["arrays"] = [image.shape, str(image.dtype), depth_m.shape, str(depth_m.dtype)]
said["one_observation"] = bool(
    (image == same.rgb).all() and np.allclose(depth_m[..., 0] * 1000, same.height_mm, atol=1e-6)
)
numbers = []
for _ in range(3):
    camera.async_read(timeout_ms=5000)
    numbers.append(camera.observation.number)
camera.read()
numbers.append(camera.observation.number)
said["numbers_grow"] = numbers == sorted(set(numbers))
process = camera._link._process
os.kill(process.pid, signal.SIGSTOP)
time.sleep(0.3)
said["max_age"] = sentence(camera.read_latest, max_age_ms=100)
said["max_age_depth"] = sentence(camera.read_latest_depth, max_age_ms=100)
camera.read_latest(max_age_ms=600_000)
said["no_newer"] = sentence(lambda: [camera.async_read(100) for _ in range(9)])
os.kill(process.pid, signal.SIGKILL)
process.wait()
camera._link._thread.join()
said["died"] = sentence(camera.read_latest)
said["died_waiting"] = sentence(camera.async_read)
said["connected_after_death"] = camera.is_connected
camera.connect()
said["connected_again"] = camera.read_latest(5000).shape
folder = camera._link._folder.name
camera.disconnect()
camera.disconnect()
said["left_behind"] = Path(folder).exists()
without = make(use_depth=False)
said["not_asked_for"] = sentence(without.read_latest_depth)
said["find"] = TactileCamera.find_cameras(task["python"])
print(json.dumps(said))
