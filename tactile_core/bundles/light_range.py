"""How the light of one unit changed while it was calibrated."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

Pairs = tuple[tuple[FiniteFloat, FiniteFloat], ...]
Size = Annotated[FiniteFloat, Field(ge=0)]


class LightRange(BaseModel):
    """What is normal for a unit: frames are compared with its reference within these limits.

    K channels have K − 2 combinations that no tilt of the surface changes.

    Attributes
    ----------
    response : (K, 2)
        Change of the logarithm of each channel per slope along x and y.
    drift : (K − 2, 2)
        Mean linear change of these combinations against the reference, per half of the image along
        x and y.
    ramp, field : float
        Largest root mean square of a linear change beyond the drift, and of one of third order.
    agreement : float
        Least share of the image whose change is explained by tilt and a change of third order.
    """

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    response: Pairs
    drift: Pairs
    ramp: Size
    field: Size
    agreement: Size
