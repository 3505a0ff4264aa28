"""Names, messages and pages use the words of the field."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (
    "tactile_core",
    "plugins",
    "sensor_profiles",
    "docs",
    "examples",
    "experiments",
    "benchmarks",
    "tests",
)
TEXTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *(
        path
        for folder in FOLDERS
        for ending in ("py", "md", "yaml")
        for path in sorted((ROOT / folder).rglob(f"*.{ending}"))
        if path != Path(__file__) and "earlier_names" not in path.name  # quotes what is avoided
    ),
]

AVOIDED = {
    # a printed marker is a marker; to mark something, and a YAML error's mark, are other words
    "markers": r"(?<!pytest\.)(?<!would )\bmarks?\b(?! (an|every|a|them|the|it|circles)\b)"
    r"(?!\.line|\.column| = error| is not None| else|=pytest)",
    "gel surface": r"\bskins?\b",
    "light or LED": r"\blamps?\b",
    "estimated, reported or distinguished": r"\b(fore|un)?told\b|\btells?\b(?!\()",
    "undeformed or reference": r"\buntouched\b|\bresting\b",
    "sheared": r"\bdrag(s|ged|ging)?\b",
    "virtual sensor": r"\bvirtual twins?\b|\bthe twins?\b",
    "sequential": r"\bin turn\b",
    "confidence": r"sureness|\bunsure\b",
    "fixed": r"\bmend(s|ed|ing)?\b",
    "decelerates": r"\bhalt(s|ed|ing)?\b",
    "marker contrast": r"\bdarkness of (a|the|its|their) marks?",
    "normal_xy": r"\bto_sines\b|algorithms\.sines",
    "mode": r"\bcommonest\b",
    "relaxed": r"\bboldly\b",
    "weight": r"whisper",
}
"""Standard term, and the pattern of words to avoid for it."""


@cache
def _read(path: Path) -> str:
    return path.read_text("utf-8")


@pytest.mark.parametrize("word", AVOIDED)
def test_texts_use_the_standard_term(word: str) -> None:
    pattern = re.compile(AVOIDED[word], re.IGNORECASE)
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in TEXTS
        if pattern.search(_read(path))  # most texts have none, and lines take time
        for number, line in enumerate(_read(path).splitlines(), start=1)
        if pattern.search(line)
    ]
    assert not found, f"write {word!r}:\n" + "\n".join(found)
