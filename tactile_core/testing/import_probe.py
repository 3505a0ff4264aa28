"""Imports a plugin's entry module in a fresh interpreter and reports the side effects.

Run it as a script: ``import_probe.py OFFER PATH RESULT``. OFFER is an entry point's fields and
PATH is ``sys.path``, both as JSON; RESULT is the output file.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import warnings
from pathlib import Path
from typing import Any

HEAVY = (
    "cv2", "cupy", "jax", "matplotlib", "onnxruntime", "open3d", "pandas", "rclpy",
    "scipy", "skimage", "sklearn", "tensorflow", "torch", "torchvision",
)  # fmt: skip
"""Packages that take 0.1 s or more to import."""


def snapshot() -> dict[str, Any]:
    """Return process state that an import must not change, by the description of a change."""
    root = logging.getLogger()
    fds = Path("/proc/self/fd")
    return {
        "changes the environment": dict(os.environ),
        "changes the working directory": str(Path.cwd()),
        "changes sys.path": list(sys.path),
        "changes the filters of warnings": list(warnings.filters),
        "sets up the root logger": (root.level, list(root.handlers), list(root.filters)),
        "leaves a thread running": {thread.name for thread in threading.enumerate()},
        "leaves a file or socket open": len(list(fds.iterdir())) if fds.is_dir() else 0,
    }


def main(offer: str, path: str, result: str) -> None:
    """Import the module of an offer, call its hooks and write ``{"heavy": …, "effects": …}``."""
    sys.path[:] = json.loads(path)
    import numpy  # noqa: F401  (allowed, although it changes the filters of warnings)

    from tactile_core.errors import PluginError
    from tactile_core.plugins.entry_points import Offer
    from tactile_core.plugins.plugin import Plugin

    before, modules = snapshot(), set(sys.modules)
    error = ""
    try:
        Plugin.load(Offer(**json.loads(offer))).report(import_components=False)
    except PluginError as refusal:
        error = str(refusal)
    after = snapshot()
    new = {name.partition(".")[0] for name in set(sys.modules) - modules}
    found = {
        "error": error,
        "heavy": sorted(new & set(HEAVY)),
        "effects": [what for what in before if before[what] != after[what]],
    }
    Path(result).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
