"""Training of networks for ``networks.force_cnn``, on virtual units or on a recording.

PyTorch is imported only inside functions, and by the modules that only training needs.
"""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_commands() -> Mapping[str, str]:
    """Return the command that trains."""
    return {"train-force": "tactile_train.commands:train_force"}
