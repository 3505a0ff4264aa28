"""What a page shows: its blocks of code, and the commands that it tells to type."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language: str, page: str = README) -> list[str]:
    """All blocks of code in a language."""
    return re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)


def block(language: str) -> str:
    """The first block of code in a language."""
    return blocks(language)[0]


def commands(page: str = README) -> list[list[str]]:
    """The words of every ``tactile …`` that a page tells to type."""
    lines = "\n".join(blocks("sh", page)).replace("\\\n", " ").splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith("tactile ")]
