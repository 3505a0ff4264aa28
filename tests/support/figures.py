"""Finds figures in pages, and those without evidence.

A page of the documentation may state two kinds of figures:

- a *measured* one, as the text of a link to the section of a page of :data:`EVIDENCE` that contains
  the same text: ``[1.2°](accuracy.md#six-leds)``;
- a *fact* (a setting, a dimension, a number from a paper), listed for its page in
  ``tests/docs/facts.yaml``.

Code, in blocks or between backticks, is not checked.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator

EVIDENCE = (
    "docs/reference/accuracy.md",
    "docs/reference/performance.md",
    "docs/reference/parameters.md",
)

_SILENT = re.compile(r"^```.*?^```$|<!--.*?-->|`[^`\n]+`|https?://\S+", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[([^\]]*)\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^(#+) (.*)$", re.MULTILINE)

_UNIT = (
    r"°|%|(?:mm²|mm/s|µm|nm|[mck]m|mm|px|ms|s|min|[KMG]i?B|kB|Hz|N·?mm|mN|N|M?Pa|bits?|times|"
    r"degrees|microns?|pixels|seconds|minutes|hours|frames|images|exposures|presses|balls|lifts|"
    r"slips|trials|grasps|sequences|recordings|markers|markers|objects)\b"
)
_DIGITS = r"\d+(?: \d{3})*(?:\.\d+)?"
_RANGE = rf"{_DIGITS}(?:\s?(?:–|-|to|and|or|×|x)\s?{_DIGITS})*"
_WORD = r"one|two|three|four|five|six|seven|eight|nine|ten|eleven|twelve|fifteen|twenty|thirty"
_PART = r"half|thirds?|quarters?|fifths?|sixths?|sevenths?|eighths?|ninths?|tenths?"
_FIGURE = re.compile(
    rf"(?<![\w.])[−+±]?\s?{_RANGE}\s?(?:{_UNIT})"  # 2 mm, 2 to 4 %, 640 × 480 pixels
    rf"|(?<![\w.])[−+±]?\d+\.\d+(?![\w.])"  # 0.987
    r"|\b\d+ of (?:the )?\d+\b"  # 14 of the 14
    rf"|\b(?:{_WORD}|several)(?: times| seconds| minutes| frames)\b"
    rf"|\b(?!one )(?:{_WORD}) of (?:the )?(?:{_WORD})\b"
    rf"|\b(?:(?:a|{_WORD}) )?(?:{_PART})(?: of)?(?: its| the) time\b"
    r"|\btwice as \w+",
    re.IGNORECASE,
)


def unbacked(page: str, text: str, facts: Iterable[str], held: Callable[[str], str]) -> list[str]:
    """Return the figures of a page that are neither measured nor facts.

    Parameters
    ----------
    page : str
        Path of the page in the repository.
    text : str
        Its Markdown.
    facts : iterable of str
        Figures that are listed for it.
    held : callable
        Returns the text of a page in the repository, for :data:`EVIDENCE`.
    """
    known = {_spaced(fact) for fact in facts}
    wrong = [figure for figure in stated(text, _is_evidence(page)) if figure not in known]
    return wrong + list(_misquoted(page, text, held))


def stated(text: str, skipped: Callable[[str], bool] = lambda link: False) -> list[str]:
    """Return the figures of a text, except those in links that are ``skipped``."""
    prose = _LINK.sub(lambda m: "…" if skipped(m[2]) else m[1], _SILENT.sub("…", text))
    prose = _spaced(re.sub(r"^\s*(?:\d+\.|[-*>]|#+(?: \d+\.)?) ", "¶ ", prose, flags=re.MULTILINE))
    return [found[0].strip() for found in _FIGURE.finditer(prose)]


def section(text: str, anchor: str) -> str | None:
    """Return the section of a heading, up to the next heading of its level; None if missing."""
    headings = list(_HEADING.finditer(text))
    for i, heading in enumerate(headings):
        if _anchor(heading[2]) == anchor:
            ends = (h.start() for h in headings[i + 1 :] if len(h[1]) <= len(heading[1]))
            return text[heading.start() : next(ends, len(text))]
    return None


def _misquoted(page: str, text: str, held: Callable[[str], str]) -> Iterator[str]:
    """Yield each quoted figure that is missing in its section, and each quote without section."""
    is_evidence = _is_evidence(page)
    for words, link in _LINK.findall(_SILENT.sub("…", text)):
        if not is_evidence(link) or not stated(words):
            continue
        path, _, anchor = link.partition("#")
        there = section(held(_target(page, path)), anchor)
        if there is None or not _holds(_spaced(there), _spaced(words)):
            yield f"[{words}]({link})"


def _holds(there: str, words: str) -> bool:
    """Return whether a text contains these words, not as part of a longer number or word."""
    return re.search(rf"(?<![\w.]){re.escape(words)}(?!\w|\.\d)", there) is not None


def _is_evidence(page: str) -> Callable[[str], bool]:
    return lambda link: _target(page, link.partition("#")[0]) in EVIDENCE


def _target(page: str, link: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), link))


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w]+", "-", heading.lower()).strip("-")


def _spaced(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()
