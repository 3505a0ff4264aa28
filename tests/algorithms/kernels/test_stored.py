"""A compiled kernel is read from the disk without what numba needs to compile."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("numba")

KERNELS = """\
import numpy as np
from numba import njit
from tactile_core.algorithms.kernels.options import LOOP, PART

@njit(**PART)
def half(value):
    return value / 2

@njit(**LOOP)
def halves(values):
    if not values.size:
        raise ValueError("no values")
    out, above = np.zeros(values.shape), values[values > 0]
    above.sort()
    for i in range(values.size):
        out[i] = half(values[i])
    return out, above.sum()

@njit(**LOOP)
def number_of(text):
    return hash(text)
"""
USE = """\
import sys
import numpy as np
import numba
import given
from tactile_core.algorithms.kernels.stored import load_alone
for kernel in (given.halves, given.number_of):
    load_alone(kernel)

def reads(kernel):
    return bool(kernel.stats.cache_hits)

"""
ONCE = """\
given.halves(np.ones(1)), given.number_of("")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with kernels that have been compiled."""
    folder = tmp_path_factory.mktemp("kernels")
    (folder / "given.py").write_text(KERNELS)
    printed(folder, ONCE)
    return folder


def printed(folder: Path, code: str) -> list[str]:
    """What code prints in a fresh process that imports from a folder, line by line."""
    paths = os.pathsep.join([str(folder), *sys.path])
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": paths}
    command = [sys.executable, "-c", USE + code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return run.stdout.splitlines()


def test_a_kernel_is_read_without_the_compiler(folder: Path) -> None:
    code = """\
print(*given.halves(np.array([2.0, -4.0, 6.0])))
print(reads(given.halves), "numba.np.arrayobj" in sys.modules, "scipy.linalg" in sys.modules)
try:
    given.halves(np.ones(0))
except ValueError as error:
    print(error)
"""
    assert printed(folder, code) == ["[ 1. -2.  3.] 8.0", "True False False", "no values"]


def test_a_kernel_that_needs_more_than_arrays_finds_it(folder: Path) -> None:
    code = """\
print(given.number_of("gel") == hash("gel"), reads(given.number_of))
"""
    assert printed(folder, code) == ["True True"]


def test_functions_of_others_compile_afterwards_and_call_it(folder: Path) -> None:
    code = """\
given.halves(np.ones(1))
@numba.njit
def solved(matrix, values):
    return np.linalg.solve(matrix, given.halves(values)[0])
print(solved(np.eye(2), np.array([2.0, 4.0])), reads(given.halves))
print(given.halves(np.ones(1, np.float32))[0])
"""
    assert printed(folder, code) == ["[1. 2.] True", "[0.5]"]


def test_numba_may_be_switched_off(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert printed(folder, "print(given.halves(np.ones(1))[0])") == ["[0.5]"]
