"""The kernels are loaded on request, unless the environment disables them."""

from __future__ import annotations

import os
import subprocess
import sys

from support.kernel_agreement import needs_kernels

from tactile_core.algorithms import kernels


def loaded_in_a_fresh_process(*, switch: str, compiled: bool) -> bool:
    code = f"from tactile_core.algorithms import kernels; print(kernels.chosen({compiled}))"
    environment = {**os.environ, kernels.SWITCH: switch}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return run.stdout.strip() != "None"


@needs_kernels
def test_numba_is_imported_only_on_request() -> None:
    assert not loaded_in_a_fresh_process(switch="", compiled=False)
    assert loaded_in_a_fresh_process(switch="", compiled=True)


def test_the_environment_turns_the_kernels_off() -> None:
    assert not loaded_in_a_fresh_process(switch="0", compiled=True)
