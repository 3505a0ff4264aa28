"""Mutations of YAML, JSON and CSV: of the structure, of lines and of characters."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from random import Random
from typing import Any

from fuzz.values import BOMB, NUMBERS, WORDS, YAML, any_value, word_of

_LONGEST = 100_000
_VALUE = re.compile(r"(:\s+|[\[,]\s*)([^\s,{}\[\]#][^,{}\[\]#\n]*)")


def corrupted_json(text: str, rng: Random) -> str:
    """Return JSON with one node changed."""
    tree = _changed(json.loads(text), rng)
    return json.dumps(tree) if rng.random() < 0.95 else '{"a":' * 20_000


def corrupted_yaml(text: str, rng: Random) -> str:
    """Return YAML with one node, value, line or character changed."""
    kind = rng.randrange(10)
    if kind < 4:
        return _value_replaced(text, rng, YAML)
    if kind < 8:
        return _as_tree(text, rng)
    return corrupted_lines(text, rng) if kind == 8 else rng.choice((BOMB, text + BOMB, "- " * 3000))


def corrupted_csv(text: str, rng: Random) -> str:
    """Return CSV with one cell or line changed."""
    if rng.random() < 0.4:
        return corrupted_lines(text, rng)
    lines = text.splitlines() or [""]
    at = rng.randrange(len(lines))
    cells = lines[at].split(",")
    value = rng.choice((*map(word_of, NUMBERS), *WORDS))
    cells[rng.randrange(len(cells))] = value
    if rng.random() < 0.2:
        cells = rng.sample(cells, len(cells)) if rng.random() < 0.5 else cells[:-1]
    lines[at] = ",".join(cells)
    return "\n".join(lines) + "\n"


def corrupted_lines(text: str, rng: Random) -> str:
    """Return the text with one line or character changed."""
    lines = text.splitlines(keepends=True) or [""]
    at = rng.randrange(len(lines))
    kind = rng.randrange(9)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(at, lines[rng.randrange(len(lines))])
    elif kind == 2:
        lines[at] = rng.choice(("  ", "\t", "- ", "? ", "# ", "--- ", "...\n")) + lines[at]
    elif kind == 3:
        lines[at] = lines[at].strip(" ")
    elif kind == 4:
        lines.insert(at, rng.choice(WORDS) + rng.choice((":", "", ": 1", '"')) + "\n")
    elif kind == 5:
        lines = lines[:at]
    elif kind == 6:
        lines = [rng.choice("\ufeff\x00\x07\x1b\u2028\u200b\x85") + "".join(lines)]
    elif kind == 7:
        lines = [line.rstrip("\n") + "\r" + rng.choice(("", "\n")) for line in lines]
    else:
        place = rng.randrange(len(lines[at]) + 1)
        lines[at] = lines[at][:place] + rng.choice("\"'{}[]:,&*!|>%@`\\\t\x00é") + lines[at][place:]
    return "".join(lines)


def _value_replaced(text: str, rng: Random, values: tuple[str, ...]) -> str:
    found = list(_VALUE.finditer(text))
    if not found:
        return corrupted_lines(text, rng)
    one = rng.choice(found)
    return text[: one.start(2)] + rng.choice(values) + text[one.end(2) :]


def _as_tree(text: str, rng: Random) -> str:
    import ruamel.yaml

    if "&" in text or len(text) > _LONGEST:  # aliases could expand beyond the memory
        return corrupted_lines(text, rng)
    try:
        tree = ruamel.yaml.YAML(typ="safe", pure=True).load(text)
        written = json.dumps(_changed(tree, rng), ensure_ascii=rng.random() < 0.8)
    except (ruamel.yaml.error.YAMLError, ValueError, TypeError, RecursionError):
        return corrupted_lines(text, rng)
    return re.sub(r"-?\b(NaN|Infinity)\b", lambda m: rng.choice((".nan", ".inf", "-.inf")), written)


def _changed(tree: Any, rng: Random) -> Any:
    """Return the tree with one node replaced, removed, renamed, repeated, wrapped or swapped."""
    places = list(_places(tree))
    if not places:
        return any_value(rng)
    holder, key = rng.choice(places)
    kind = rng.randrange(10)
    if kind < 5:
        holder[key] = any_value(rng)
    elif kind == 5:
        del holder[key]
    elif kind == 6 and isinstance(holder, dict):
        holder[rng.choice((*WORDS, str(key) + "x", str(key).upper()))] = holder.pop(key)
    elif kind == 7:
        holder[key] = [holder[key]] * rng.choice((1, 2, 50))
    elif kind == 8:
        holder[key] = {"use": holder[key]} if rng.random() < 0.5 else str(holder[key])
    else:
        other, theirs = rng.choice(places)
        holder[key], other[theirs] = other[theirs], 1
    return tree


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in list(keys):
        yield tree, key
        yield from _places(tree[key])
