"""What the names of image files say: their order, and their times."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from itertools import pairwise
from typing import TypeVar

T = TypeVar("T")

_SUFFIX = re.compile(r"\.[a-z]\w*$", re.IGNORECASE)
_WHOLE = re.compile(r"([0-9]+)")
_DECIMAL = re.compile(r"([0-9]+(?:[.,][0-9]+)?)")
_FRACTION = re.compile(r"[0-9]+[.,]([0-9]+)")
_SECONDS = re.compile(r"(?:t|time)?[ _=-]?([0-9]+(?:[.,][0-9]+)?)s?", re.IGNORECASE)
_EPOCH = re.compile(r"(.*?)(?<![0-9.,])([0-9]{13}|[0-9]{16}|[0-9]{19})(?![0-9.,])(.*)")
# The years 2000 to 2100, of which integers are the times since 1970.
_EPOCH_YEARS_S = 946_684_800, 4_102_444_800


def sorted_by_name(items: Iterable[T], name: Callable[[T], str]) -> list[T]:
    """Sort by the numbers in names: ``2`` before ``10``, ``12.04`` before ``12.2``, and a copy
    such as ``2 (1)`` after its original.

    Parameters
    ----------
    items : iterable
    name : callable
        Returns the name of an item, with or without a suffix.
    """
    items = list(items)
    decimal = _are_decimals(map(name, items))

    def key(item: T) -> tuple[list[str | Decimal], str]:
        stem = _SUFFIX.sub("", name(item)).casefold()
        parts = (_DECIMAL if decimal else _WHOLE).split(stem)
        return [_number(part) if i % 2 else part for i, part in enumerate(parts)], name(item)

    return sorted(items, key=key)


def times_of(stems: Sequence[str]) -> tuple[float, ...] | None:
    """Return the times that names of images give, s; None if these are no times.

    Times are a rising run of decimal numbers of seconds (``12.04``, ``t12.2``), or of integers of
    13, 16 or 19 digits: milliseconds, microseconds or nanoseconds since 1970, all behind the same
    word.
    """
    times = _seconds(stems) or _since_1970(stems)
    if times is None or any(b <= a for a, b in pairwise(times)):
        return None
    return times


def _seconds(stems: Sequence[str]) -> tuple[float, ...] | None:
    found = [_SECONDS.fullmatch(stem) for stem in stems]
    if not any(map(_FRACTION.search, stems)) or not _are_decimals(stems):
        return None
    times = tuple(float(_number(one[1])) for one in found if one is not None)
    return times if len(times) == len(stems) > 1 else None


def _since_1970(stems: Sequence[str]) -> tuple[float, ...] | None:
    found = [one for stem in stems if (one := _EPOCH.fullmatch(stem)) is not None]
    if len({(one[1], len(one[2]), one[3]) for one in found}) != 1 or not 1 < len(found) == len(
        stems
    ):
        return None
    units = 10 ** (len(found[0][2]) - 10)
    times = tuple(int(one[2]) / units for one in found)
    return times if _EPOCH_YEARS_S[0] <= times[0] <= times[-1] <= _EPOCH_YEARS_S[1] else None


def _are_decimals(names: Iterable[str]) -> bool:
    """Whether ``1.2`` is a decimal number, not a 1 and a 2 as in ``1.9`` before ``1.10``.

    Decimals are printed with equally many digits, or without the last zeros.
    """
    stems = (_SUFFIX.sub("", name) for name in names)
    fractions = {one for stem in stems for one in _FRACTION.findall(stem)}
    equal = len(set(map(len, fractions))) == 1
    return equal or not any(one.endswith("0") and one != "0" for one in fractions)


def _number(part: str) -> Decimal:
    return Decimal(part.replace(",", "."))
