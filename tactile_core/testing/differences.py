"""Differences of quantities, and faults in words."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.quantities import Quantity

T = TypeVar("T")


def difference(first: object, second: object, name: str = "result") -> str:
    """Return the first difference between two values, or ""; NaN equals NaN."""
    if type(first) is not type(second):
        return f"{name} is {type(first).__name__}, then {type(second).__name__}"
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return _array_difference(first, second, name)
    if is_dataclass(first) and not isinstance(first, type):
        parts = ((f.name, getattr(first, f.name), getattr(second, f.name)) for f in fields(first))
        return next((d for n, a, b in parts if (d := difference(a, b, n))), "")
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        if list(first) != list(second):
            return f"{name} has {list(first)}, then {list(second)}"
        return next((d for k in first if (d := difference(first[k], second[k], str(k)))), "")
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        if len(first) != len(second):
            return f"{name} has {len(first)} entries, then {len(second)}"
        return next((d for a, b in zip(first, second, strict=True) if (d := difference(a, b))), "")
    same = bool(first == second) or (first != first and second != second)
    return "" if same else f"{name} is {first!r}, then {second!r}"


def arrays_in(quantity: Quantity) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the arrays among a quantity's fields."""
    for field in fields(quantity):
        value = getattr(quantity, field.name)
        if isinstance(value, np.ndarray):
            yield field.name, value


def copy_arrays(
    quantities: Mapping[type[Quantity], Quantity],
) -> dict[type[Quantity], dict[str, Any]]:
    """Copy the arrays of quantities, to detect later changes."""
    return {kind: {n: a.copy() for n, a in arrays_in(q)} for kind, q in quantities.items()}


def change_of_inputs(
    quantities: Mapping[type[Quantity], Quantity],
    action: Callable[[dict[type[Quantity], Any]], object],
) -> str:
    """Return how an action changes its inputs, or "".

    The inputs are copies whose arrays are writable, like those from a camera.
    """
    given = {
        kind: replace(quantity, **{name: array.copy() for name, array in arrays_in(quantity)})
        for kind, quantity in quantities.items()
    }
    before = copy_arrays(given)
    action(given)
    return difference(before, copy_arrays(given))


def pickling_fault(original: T, results: Callable[[T], object]) -> str:
    """Return why an object cannot be pickled, or how the results of its copy differ, or ""."""
    try:
        copy = pickle.loads(pickle.dumps(original))
    except Exception as error:
        return f"it cannot be pickled ({describe_error(error)})"
    differs = difference(results(original), results(copy))
    return differs and f"its pickled copy gives other results: {differs}"


def _array_difference(first: NDArray[Any], second: NDArray[Any], name: str) -> str:
    if (first.shape, first.dtype) != (second.shape, second.dtype):
        return f"{name} is {first.dtype} {first.shape}, then {second.dtype} {second.shape}"
    if np.array_equal(first, second, equal_nan=first.dtype.kind in "fc"):
        return ""
    count = np.count_nonzero(first != second)
    return f"{count} of {first.size} values of {name} differ"


def describe_error(error: BaseException) -> str:
    """Return the type and the message of an error."""
    return f"{type(error).__name__}: {error}"


class Fault(AssertionError):
    """A fault of a plugin, reported with its consequence and a remedy.

    Parameters
    ----------
    where : object
        The component or profile; its string is its name.
    found : str
        The observed fault.
    why : str
        The consequence for users of the plugin.
    do : str
        How to fix it.
    """

    def __init__(self, where: object, found: str, *, why: str, do: str) -> None:
        super().__init__(f"{where}: {found}\n  Why it matters: {why}\n  What to do: {do}")


def report(where: object, found: str, *, why: str, do: str) -> None:
    """Raise a :class:`Fault` if something was found."""
    if found:
        raise Fault(where, found, why=why, do=do)


@contextmanager
def report_errors(where: object, found: str, *, why: str, do: str) -> Iterator[None]:
    """Turn an error inside the block into a :class:`Fault` that begins with ``found``."""
    try:
        yield
    except (CannotCheck, Fault):
        raise
    except Exception as error:
        raise Fault(where, f"{found} ({describe_error(error)})", why=why, do=do) from error


class CannotCheck(Exception):
    """A check cannot run, because its subject is missing or failed another check."""


@contextmanager
def depend_on(check: str) -> Iterator[None]:
    """Turn an error inside the block, which another check reports, into :class:`CannotCheck`."""
    try:
        yield
    except CannotCheck:
        raise
    except Exception as error:
        raise CannotCheck(f"see the check {check!r}: {error}") from error
