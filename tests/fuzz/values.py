"""Problematic values: numbers, words, paths and pieces of YAML."""

from __future__ import annotations

import math
from random import Random
from typing import Any

NUMBERS: tuple[Any, ...] = (
    *(0, -1, 1, 2, 3, 7, -0.0, 0.5, 1e-9, 1e-300, 5e-324, 1e9, 1e30, 1e300, 1.8e308),
    *(math.nan, math.inf, -math.inf, 255, 256, 32767, 65535, 65536, 2**31 - 1, 2**31, 2**32, 2**63),
    *(10**22, 10**400, -(2**63), 100_000, 4097, 359.9, 360, 90, -90),
)
WORDS: tuple[str, ...] = (
    *("", " ", ".", "..", "-", "--", "core.", ".core", "core.poisson", "core.nothing", "a" * 300),
    *("../up", "a/b", "a\nb", "a\u2028b", "\x1b[31mred\x1b[0m", "\u202ea", "é ü 漢"),
    *("null", "true", "nan", "inf", "-inf", "1e400", "0x10", "1_000", "٣", "1,2", "first", "auto"),
    *("%s%n", "{0}", "${HOME}", "~", "~nosuch", "$(id)", "'", '"', "\\", "CON", "\udcff", "🙂"),
)
PATHS: tuple[str, ...] = (
    *(
        "",
        ".",
        "..",
        "nowhere",
        "nowhere/inside",
        "small.yaml/inside",
        "presses",
        "frames",
        "ref.png",
    ),
    *(
        "bundle",
        "scan",
        "scans",
        "scan/scan.yaml",
        "film.avi",
        "map.tmd",
        "grid.yaml",
        "labels.csv",
    ),
    *("played", "played/truth", "sheared/frames", "/nonexistent/x", "/dev/null", "/proc/self/mem"),
    *(
        "~",
        "~nosuch/x",
        "first",
        "a" * 300,
        "http:v.avi",
        "file:///etc/passwd",
        "x\ny.png",
        "\udcff.png",
    ),
    *(
        "empty",
        "fifo",
        "loop",
        "odd/\x1b[31m.png",
        "empty.png",
        "small.yaml",
        "turn.yaml",
        "-",
        "--",
    ),
)
YAML: tuple[str, ...] = (
    *(
        ".nan",
        ".inf",
        "-.inf",
        "~",
        "null",
        "{}",
        "[]",
        "[[]]",
        "{a: 1}",
        "true",
        "no",
        "''",
        '"\\u2028"',
    ),
    *(
        "0",
        "-1",
        "1e400",
        "1e-400",
        "0x7fffffff",
        "0o17",
        "1_000",
        "1:30:00",
        "2001-01-01",
        "- -",
        "<<",
    ),
    *(
        "!!python/object/apply:os.getcwd []",
        "!!binary aGk=",
        "!!set {a, b}",
        "!!timestamp 2001-01-01",
    ),
    *("&a [*a]", "*nowhere", "&x {y: *x}", "|\n  text", "[1, 2, 3, 4, 5]", "{use: core.nothing}"),
    *(
        "{use: core.poisson}",
        "core.poisson",
        "'\\'",
        '"unclosed',
        "[1, 2",
        "{a: b: c}",
        "\t1",
        "@x",
        "%x",
    ),
    *(
        "99999999999999999999999",
        "1e30",
        "1e9",
        "-1e9",
        "[" * 60,
        "{a: " * 400,
        "a" * 5000,
        '"\\x1b[31m"',
    ),
)
BOMB = (
    "a: &a [x, x, x, x, x, x, x, x, x]\n"
    + "".join(
        f"{new}: &{new} [{', '.join(9 * [f'*{old}'])}]\n"
        for old, new in zip("abcdefgh", "bcdefghi", strict=True)
    )
    + "images: *i\nname: *i\nradius: *i\n"
)
"""Four hundred bytes of YAML that expand to 9⁹ words."""


def any_value(rng: Random) -> Any:
    """Return a number, a word, None, a bool or a container of these."""
    kind = rng.randrange(10)
    if kind < 5:
        return rng.choice(NUMBERS)
    if kind < 7:
        return rng.choice(WORDS)
    if kind == 7:
        return rng.choice((None, True, False, [], {}))
    if kind == 8:
        return [rng.choice(NUMBERS) for _ in range(rng.randrange(6))]
    return {rng.choice(WORDS): rng.choice(NUMBERS)}


def word_of(value: Any) -> str:
    """Return a value as a word of a command line."""
    return value if isinstance(value, str) else repr(value) if value < 10**100 else "9" * 400
