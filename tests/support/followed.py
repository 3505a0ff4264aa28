"""Follows a page of the documentation as its reader would, in a folder of its own."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from support.dist_info import write_dist_info

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"(?:^`([\w./-]+)`:\n\n)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass
class Reader:
    """Somebody who does what pages say, from top to bottom.

    A block under a file's name is written to that file. Python is run, in a process of its own. Of
    a shell block every line is typed, and one that begins with ``!`` has to fail. A block of text
    is what the commands before it have printed, among other things.
    """

    folder: Path
    printed: str = field(default="", init=False)
    installed: list[Path] = field(default_factory=list, init=False)

    def follow(self, page: Path) -> None:
        """Do all that a page says."""
        for name, language, block in BLOCK.findall(page.read_text(encoding="utf-8")):
            if name:
                path = self.folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block, encoding="utf-8")
            elif language == "python":
                self._run([sys.executable, "-c", block])
            elif language == "sh":
                self.printed = ""
                for line in block.replace("\\\n", " ").splitlines():
                    self._type(line)
            elif language == "text":
                missing = [line for line in block.splitlines() if line not in self.printed]
                assert missing == [], self.printed

    def _type(self, line: str) -> None:
        fails = line.startswith("! ")
        program, *words = shlex.split(line.removeprefix("! "))
        if program == "pip":
            self._install(words)
            return
        module = {"tactile": "tactile_core.cli", "pytest": "pytest"}[program]
        self._run([sys.executable, "-m", module, *words], fails=fails)

    def _install(self, words: list[str]) -> None:
        """Make a package known as ``pip install -e`` would, without network."""
        assert words[:2] == ["install", "-e"]
        site = self.folder / "site"
        site.mkdir(exist_ok=True)
        project = self.folder / words[2]
        write_dist_info(project, site)
        self.installed += [project, site]

    def _run(self, words: list[str], *, fails: bool = False) -> None:
        path = [*map(str, self.installed), os.environ.get("PYTHONPATH", "")]
        done = subprocess.run(
            words,
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
            capture_output=True,
            text=True,
            check=False,
        )
        self.printed += done.stdout + done.stderr
        assert (done.returncode != 0) == fails, done.stdout + done.stderr
