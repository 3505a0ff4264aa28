"""What every measured thing has in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Quantity:
    """Base of everything a :class:`~tactile_core.interfaces.estimator.Estimator` may take or give.

    A third party's quantity subclasses this and is saved and streamed like ours.
    """

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                view = value.view()
                view.flags.writeable = False
                object.__setattr__(self, name, view)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Named arrays to store in an ``.npz``."""
        return {}

    def summary(self) -> Mapping[str, Any]:
        """A few JSON-ready numbers for a line of ``tactile run --json``."""
        return {}

    def warnings(self) -> tuple[str, ...]:
        """Plain sentences that a reading passes on to the user."""
        return ()
