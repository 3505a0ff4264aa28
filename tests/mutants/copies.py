"""A copy of the tree for mutants, with tests that import only the copy."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mutants.catalogue import ROOT, Mutant
from tactile_core.pipeline.one_thread import ONE_THREAD

_LEFT_OUT = (".git", ".venv", "__pycache__", "*.egg-info", ".*_cache", "site", "dist", "demo")
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+?::[^\s\[]+)", re.MULTILINE)
_TESTS_FAILED = 1
_MUTANT_S, _ALL_S = 600.0, 3600.0
"""Time limits of the tests of one mutant and of all tests, s."""

_PLUGINS = ("tactile_baxter_fingertip", "tactile_desktop_six_led", "tactile_hex_fingertip")


@dataclass(frozen=True)
class Outcome:
    """The result of a test run.

    Attributes
    ----------
    detected_by : str
        The first test that failed; empty if all passed.
    trouble : str
        Why the run has no result, with its output; empty if it has one.
    """

    detected_by: str = ""
    trouble: str = ""


class Copy:
    """A copy of the tree, for one worker.

    Files keep their modification times, also when a mistake is reverted, and no bytecode is
    written after the preparation. So every import uses the current source.
    """

    def __init__(self, folder: Path) -> None:
        self.tree = folder / "tree"
        self._compiled = folder / "pyc"
        shutil.copytree(ROOT, self.tree, ignore=shutil.ignore_patterns(*_LEFT_OUT))
        self._run(["-m", "compileall", "-q", "tactile_core", "plugins"], self._environment())
        self._check_imports()

    def tested(self, tests: Sequence[str]) -> Outcome:
        """Run tests on the unchanged tree."""
        return self._tested(tests, _ALL_S)

    def mutated(self, mutant: Mutant) -> Outcome:
        """Apply a mutant, run its tests and revert it."""
        path = self.tree / mutant.file
        text, times = mutant.made_in(self.tree), path.stat()
        before = path.read_bytes()
        try:
            path.write_text(text, encoding="utf-8")
            return self._tested(mutant.tests, _MUTANT_S)
        finally:
            path.write_bytes(before)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def _tested(self, tests: Sequence[str], limit_s: float) -> Outcome:
        every = ["-m", ""]  # also tests that are not part of 'make test'
        command = ["-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--tb=no", *every, *tests]
        try:
            done = self._run(
                command, self._environment() | {"PYTHONDONTWRITEBYTECODE": "1"}, limit_s
            )
        except subprocess.TimeoutExpired:
            return Outcome(trouble=f"not finished within {limit_s:.0f} s")
        if done.returncode == 0:
            return Outcome()
        failed = _FAILED.search(done.stdout)
        if done.returncode == _TESTS_FAILED and failed:
            return Outcome(detected_by=failed[1])
        return Outcome(trouble=f"pytest ended with {done.returncode}\n{done.stdout}{done.stderr}")

    def _environment(self) -> dict[str, str]:
        paths = [self.tree, *sorted(self.tree.glob("plugins/tactile-*"))]
        data = ROOT.parent / "shared" / "data"
        return {
            "TACTILE_TEST_DATA": str(data),
            **os.environ,
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "PYTHONPYCACHEPREFIX": str(self._compiled),
            **ONE_THREAD,
        }

    def _check_imports(self) -> None:
        """Raise an error if the tests would import the installed packages."""
        modules = "tactile_core", *_PLUGINS
        code = f"import {', '.join(modules)}; print(*(m.__file__ for m in ({', '.join(modules)})))"
        found = self._run(["-c", code], self._environment()).stdout.split()
        strays = [path for path in found if not Path(path).is_relative_to(self.tree)]
        if strays or len(found) != len(modules):
            raise RuntimeError(f"{strays or modules} would be tested instead of the copy")

    def _run(
        self, arguments: Sequence[str], environment: dict[str, str], limit_s: float = _ALL_S
    ) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.tree,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit_s,
            check=False,
        )
