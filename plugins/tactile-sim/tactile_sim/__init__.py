"""Virtual sensors for tactile-core: frames of any profile without hardware, with ground truth.

``VirtualStage`` moves an object on the gel surface of any profile. ``Faults`` describes defects of
the rig. Both are imported on first use; their places are in ``__init__.pyi``.
"""

from __future__ import annotations

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
