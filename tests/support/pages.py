"""The blocks of code of a page, and the commands in them."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language: str, page: str = README) -> list[str]:
    """Return all blocks of code in a language."""
    return re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)


def block(language: str) -> str:
    """Return the first block of code in a language."""
    return blocks(language)[0]


def commands(page: str = README) -> list[list[str]]:
    """Return the arguments of every command ``tactile …`` of a page."""
    lines = "\n".join(blocks("sh", page)).replace("\\\n", " ").splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith("tactile ")]
