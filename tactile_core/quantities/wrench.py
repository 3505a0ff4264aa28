"""Force and torque on the gel, a load in a recording's own unit, and what a network says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32, Float64
from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity

_N, _NMM = FieldSpec("N", saved_as="wrench"), FieldSpec("N·mm", saved_as="wrench")
_STD_N = FieldSpec("N", saved_as="wrench_std", std_of="wrench")
_STD_NMM = FieldSpec("N·mm", saved_as="wrench_std", std_of="wrench")

# Standard deviation in N or N·mm of a component that is not measured, and is 0
UNKNOWN_LOAD = 1e6


@dataclass(frozen=True, eq=False)
class Wrench(Quantity):
    """The load that the object puts on the sensor.

    Attributes
    ----------
    fx_n, fy_n : float
        Shear force along x and y: a surface that is sheared towards +x has a positive fx.
    fz_n : float
        Normal force, positive in compression.
    tz_nmm : float
        Torque about the z axis through the image centre, positive from x towards y.
    fx_std_n, fy_std_n, fz_std_n, tz_std_nmm : float or None
        Standard deviations; all None if they are unknown.
    """

    fx_n: Annotated[float, _N]
    fy_n: Annotated[float, _N]
    fz_n: Annotated[float, _N]
    tz_nmm: Annotated[float, _NMM]
    fx_std_n: Annotated[float | None, _STD_N] = None
    fy_std_n: Annotated[float | None, _STD_N] = None
    fz_std_n: Annotated[float | None, _STD_N] = None
    tz_std_nmm: Annotated[float | None, _STD_NMM] = None
    timestamp_s: TimestampS = 0.0

    @classmethod
    def from_values(
        cls, values: Float64, std: Float64 | None = None, timestamp_s: float = 0.0
    ) -> Wrench:
        """Return the load with these :attr:`values` and standard deviations, (4,) each."""
        names = "fx_n", "fy_n", "fz_n", "tz_nmm"
        stds = "fx_std_n", "fy_std_n", "fz_std_n", "tz_std_nmm"
        found = dict(zip(names, map(float, values), strict=True))
        known = {} if std is None else dict(zip(stds, map(float, std), strict=True))
        return cls(**found, **known, timestamp_s=timestamp_s)

    @property
    def values(self) -> Float64:
        """(4,) float64: fx, fy, fz in N and tz in N·mm."""
        return np.array([self.fx_n, self.fy_n, self.fz_n, self.tz_nmm])

    @property
    def std(self) -> Float64 | None:
        """(4,) float64 standard deviations of :attr:`values`; None if they are unknown."""
        found = self.fx_std_n, self.fy_std_n, self.fz_std_n, self.tz_std_nmm
        return None if None in found else np.array(found, np.float64)

    @property
    def measured(self) -> Bool:
        """(4,) bool: the component is measured; another one is 0 and nothing is known of it."""
        std = self.std
        return np.ones(4, np.bool_) if std is None else std < UNKNOWN_LOAD

    def about(self, point_mm: tuple[float, float]) -> Wrench:
        """Return the same load with its torque about the z axis through another point.

        The standard deviations of the components count as independent.

        Parameters
        ----------
        point_mm : (x, y)
            Relative to the image centre.
        """
        x_mm, y_mm = point_mm
        moved = replace(self, tz_nmm=self.tz_nmm - x_mm * self.fy_n + y_mm * self.fx_n)
        std = self.std
        if std is None:
            return moved
        fx_std, fy_std, _, tz_std = std
        total = np.sqrt(tz_std**2 + (x_mm * fy_std) ** 2 + (y_mm * fx_std) ** 2)
        return replace(moved, tz_std_nmm=float(total))

    def in_sensor_frame(self) -> Float64:
        """(6,) float64: force in N and torque in N·mm in the right-handed frame of the sensor.

        There z points away from the camera, so that a pressing load has a negative force along z.
        Torques about x and y are not measured and 0.
        """
        return np.array([self.fx_n, self.fy_n, -self.fz_n, 0.0, 0.0, self.tz_nmm])

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return ``wrench`` and, if they are known, ``wrench_std``, as (4,) float32."""
        found = super().arrays()
        return {
            name: array.astype(np.float32) if name.startswith("wrench") else array
            for name, array in found.items()
        }

    def text(self) -> str:
        """Return the normal force in words; empty without any."""
        if not self.measured[2] or not self.fz_n:
            return ""
        deviation = "" if self.fz_std_n is None else f" ± {self.fz_std_n:.2g}"
        return f"normal force {self.fz_n:.3g}{deviation} N"

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``wrench``."""
        std = self.std
        return {
            "wrench": {
                "fx_n": self.fx_n,
                "fy_n": self.fy_n,
                "fz_n": self.fz_n,
                "tz_nmm": self.tz_nmm,
                "std": None if std is None else std.tolist(),
            }
        }


@dataclass(frozen=True, eq=False)
class RelativeLoad(Quantity):
    """A number that grows with the normal force; its scale depends on the sensor and the object.

    Attributes
    ----------
    load : float
        Dimensionless; 0 at rest, apart from noise.
    """

    load: Annotated[float, FieldSpec(saved_as="load")]
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class NetworkOutput(Quantity):
    """Numbers from a network: an embedding, or measurements that no other quantity holds.

    Attributes
    ----------
    values : (N,) float32
    names : tuple of N str
        Empty for an embedding.
    unit : str
        Of all values; empty if they are dimensionless.
    """

    values: Annotated[Float32, FieldSpec(axes=("output",), saved_as="network_output")]
    names: tuple[str, ...] = ()
    unit: str = ""
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``network``: the values by name, or as a list."""
        numbers = [float(value) for value in self.values]
        named = dict(zip(self.names, numbers, strict=True)) if self.names else numbers
        return {"network": {"values": named, "unit": self.unit}}
