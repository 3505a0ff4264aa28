"""Runs tests twice: with compiled kernels, and with the numpy code that defines them.

With numpy they run in ``make test-plain``; without numba, always.

A module requests it by ``pytestmark = pytest.mark.usefixtures("kernels_or_numpy")``. A module's
fixture whose value is computed by kernels has ``kernels_or_numpy`` among its arguments, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from types import ModuleType

import pytest

PATHS = (
    ("compiled", pytest.param("numpy", marks=pytest.mark.plain))
    if find_spec("numba")
    else ("numpy",)
)


@pytest.fixture(scope="module", params=PATHS)
def kernels_or_numpy(request: pytest.FixtureRequest) -> Iterator[str]:
    """Name of the implementation in use; new processes inherit it through the environment."""
    from tactile_core.algorithms import kernels
    from tactile_core.sim import kernels as of_sim

    with pytest.MonkeyPatch.context() as patch:
        if request.param == "numpy":
            patch.setenv(kernels.SWITCH, "0")
            for module in (kernels, of_sim):
                patch.setattr(module, "load", lambda: None)
        else:
            # also for steps and functions that are called without an explicit choice
            for module in (kernels, of_sim):
                patch.setattr(module, "chosen", lambda compiled, load=module.load: load())
        yield request.param


@pytest.fixture(scope="module", autouse=True)
def _no_kernel_without_its_numpy(request: pytest.FixtureRequest) -> Iterator[None]:
    """Check, in the folders that import this, that a module with kernels also runs without."""
    from tactile_core.algorithms import kernels

    marker = getattr(request.module, "pytestmark", None)
    runs_both = marker is not None and "kernels_or_numpy" in marker.args
    if runs_both or request.path.parent.name == "kernels":  # those compare the two
        yield
        return
    calls: list[str] = []
    chosen = kernels.chosen

    def noted(compiled: bool) -> ModuleType | None:
        loops = chosen(compiled)
        if loops is not None:
            calls.append("")
        return loops

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels, "chosen", noted)
        yield
    assert not calls, (
        "compiled kernels run here: mark the module as described in tests/support/kernel_paths.py"
    )
