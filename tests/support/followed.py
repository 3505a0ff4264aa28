"""Executes a page of the documentation like a reader, in a folder of its own."""

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
    """Executes the blocks of pages, from top to bottom.

    A block under a file name is written to that file. Python blocks run in a separate process
    of the interpreter ``python``. Each
    line of a shell block is run; a line that begins with ``!`` has to fail. Each line of a text
    block has to be part of the output of the preceding commands.
    """

    folder: Path
    python: str = sys.executable
    printed: str = field(default="", init=False)
    installed: list[Path] = field(default_factory=list, init=False)

    def follow(self, page: Path) -> None:
        """Execute all blocks of a page."""
        for name, language, block in BLOCK.findall(page.read_text(encoding="utf-8")):
            if name:
                path = self.folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block, encoding="utf-8")
            elif language == "python":
                self._run([self.python, "-c", block])
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
        """Install a package like ``pip install -e``, without network."""
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
