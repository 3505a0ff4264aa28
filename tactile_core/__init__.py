"""A plugin framework for optical tactile sensors of the GelSight family.

The public names are in ``__init__.pyi``. Each is imported on first use, so that
``import tactile_core`` is fast.
"""

from __future__ import annotations

from typing import Any

from lazy_loader import attach_stub

__version__ = "0.1.0"

_imported, __dir__, _names = attach_stub(__name__, __file__)
__all__ = [*_names, "__version__"]


def __getattr__(name: str) -> Any:
    try:
        return _imported(name)
    except (ImportError, AttributeError) as error:
        from tactile_core.plugins.entry_points import opencv_fault_behind

        fault = opencv_fault_behind(error)
        if fault:
            raise ImportError(fault) from error
        raise
