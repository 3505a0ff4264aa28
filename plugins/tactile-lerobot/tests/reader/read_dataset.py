"""Reads a data set with LeRobot's own class, in an environment of LeRobot.

Usage: python read_dataset.py DATASET OUT.npz
"""

import json
import sys
from contextlib import suppress

import numpy as np
import torch

# compiled operators that torchvision lacks beside a PyTorch for CPUs, and does not import without
for operator in ("nms", "qnms"):
    with suppress(RuntimeError):
        signature = "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor"
        torch.library.define(f"torchvision::{operator}", signature)

from lerobot.datasets.lerobot_dataset import LeRobotDataset  # noqa: E402

path, out = sys.argv[1:]
dataset = LeRobotDataset("local/tactile", root=path)
found = {}
for index in range(len(dataset)):
    for key, value in dataset[index].items():
        array = np.asarray(value) if isinstance(value, str) else value.numpy()
        found.setdefault(key, []).append(array)
about = {
    "frames": dataset.num_frames,
    "episodes": dataset.num_episodes,
    "fps": dataset.fps,
    "cameras": list(dataset.meta.camera_keys),
    "features": dataset.meta.features,
    "statistics": {key: sorted(values) for key, values in dataset.meta.stats.items()},
}
steps = {"observation.timestamp_ns": [0, 1 / dataset.fps]}
pair = LeRobotDataset("local/tactile", root=path, delta_timestamps=steps)
found["pair"] = [pair[0]["observation.timestamp_ns"].numpy()]
loader = torch.utils.data.DataLoader(dataset, batch_size=2)
about["batch"] = {k: list(v.shape) for k, v in next(iter(loader)).items() if hasattr(v, "shape")}
np.savez(out, about=json.dumps(about), **{key: np.stack(values) for key, values in found.items()})
