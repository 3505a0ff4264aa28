"""Imports what a plugin registers in a fresh interpreter and reports the side effects.

Run it as a script: ``import_probe.py OFFER PATH RESULT >PRINTED``. OFFER is an entry point's fields
and PATH is ``sys.path``, both as JSON; RESULT is the output file. PRINTED must be a file, so that
what is printed can be assigned to the import that prints it.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from functools import partial
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


def observe(imports: Callable[[], object]) -> dict[str, Any]:
    """Return the side effects of an import: ``{"error": …, "heavy": …, "effects": …, …}``."""
    from tactile_core.errors import PluginError

    before, modules = snapshot(), set(sys.modules)
    printed = os.fstat(1).st_size
    error = ""
    try:
        imports()
    except PluginError as refusal:
        error = str(refusal)
    sys.stdout.flush()
    after = snapshot()
    new = {name.partition(".")[0] for name in set(sys.modules) - modules}
    return {
        "error": error,
        "heavy": sorted(new & set(HEAVY)),
        "effects": [what for what in before if before[what] != after[what]],
        "printed": (printed, os.fstat(1).st_size),
    }


def observe_all(offer: dict[str, str]) -> Iterator[dict[str, Any]]:
    """Yield the side effects of the hooks' module, of each command and of each component."""
    from tactile_core.plugins.entry_points import Offer
    from tactile_core.plugins.plugin import Plugin, kind_in_words

    loading = partial(Plugin.load, Offer(**offer))
    hooks = observe(lambda: loading().report(import_components=False))
    yield {"what": "its hooks' module", "listed": True, **hooks}
    if hooks["error"]:
        return
    plugin = loading()
    registered = plugin.report(import_components=False)
    for name in registered.commands:
        found = observe(partial(plugin.command, name))
        yield {"what": f"its command {name}", "listed": True, **found}
    for kind, names in registered.components.items():
        for name in names:
            found = observe(partial(plugin.component, kind, name))
            yield {"what": f"its {kind_in_words(kind)} {name}", "listed": False, **found}


def main(offer: str, path: str, result: str) -> None:
    """Import what an offer registers and write the side effects of each import."""
    sys.path[:] = json.loads(path)
    import numpy  # noqa: F401  (allowed, although it changes the filters of warnings)

    found = list(observe_all(json.loads(offer)))
    Path(result).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
