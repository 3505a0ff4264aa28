"""Checks of the module that a plugin's entry point names: it is light, and changes nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_core.plugins.entry_points import Offer
from tactile_core.testing import import_probe as probe
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.faults import Fault, Unjudged

_LONGEST_S = 60.0
_MOVE = "move it into the module of the component that needs it, which is imported when it is named"


@dataclass(frozen=True)
class Imported:
    """What importing a plugin's entry module did.

    Attributes
    ----------
    heavy : tuple of str
        Heavy packages that it imported.
    effects : tuple of str
        What it changed.
    output : str
        What it printed.
    """

    heavy: tuple[str, ...]
    effects: tuple[str, ...]
    output: str


class ImportChecks(Suite):
    """What happens when any profile names anything of the plugin."""

    @check()
    def test_light_import(self) -> None:
        """Naming a plugin imports no heavy package."""
        found = self._imported()
        if found.heavy:
            raise Fault(
                f"plugin {self.plugin!r}",
                f"its hooks' module imports {', '.join(found.heavy)}",
                why="listing plugins and naming any of its components waits for that",
                do=_MOVE,
            )

    @check()
    def test_import_effects(self) -> None:
        """Importing the plugin prints nothing and changes nothing in the process."""
        found = self._imported()
        if found.heavy:
            raise Unjudged("see the check 'light_import'; such packages have effects of their own")
        effects = list(found.effects)
        if found.output:
            effects.append(f"prints {found.output[:60]!r}")
        if effects:
            raise Fault(
                f"plugin {self.plugin!r}",
                f"importing its hooks' module {', '.join(effects)}",
                why="it is imported into other people's programs, merely to list what there is",
                do="do it in the component that needs it (a device, in _open); log to "
                "logging.getLogger(__name__) and leave handlers to the program",
            )

    def _imported(self) -> Imported:
        if self.registered.plugin is None:
            raise Unjudged("see the check 'registration'")
        return imported(self.registered.plugin.offer, tuple(sys.path))


def _first_environment() -> dict[str, str]:
    """The environment before anything was imported here, where the system tells."""
    try:
        entries = os.fsdecode(Path("/proc/self/environ").read_bytes()).split("\0")
    except OSError:
        return dict(os.environ)
    return dict(entry.split("=", 1) for entry in entries if "=" in entry)


@cache
def imported(offer: Offer, path: tuple[str, ...]) -> Imported:
    """Import what an offer names in an interpreter of its own.

    Raises
    ------
    Unjudged
        It cannot be imported there.
    """
    with TemporaryDirectory(prefix="tactile-probe-") as folder:
        result = Path(folder) / "result.json"
        arguments = [json.dumps(asdict(offer)), json.dumps(path), str(result)]
        done = subprocess.run(
            [sys.executable, str(probe.__file__), *arguments],
            env={**_first_environment(), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
            timeout=_LONGEST_S,
            check=False,
        )
        if not result.is_file():
            raise Unjudged(f"{offer} cannot be imported on its own: {done.stderr[-500:]}")
        found = json.loads(result.read_text(encoding="utf-8"))
    if found["error"]:
        raise Unjudged(found["error"])
    return Imported(tuple(found["heavy"]), tuple(found["effects"]), done.stdout)
