"""Which devices belong to which unit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text, write_atomically
from tactile_core.formats.folders import make_folder
from tactile_core.interfaces.device import ConnectedDevice

DeviceKind = Literal["camera", "light_driver"]  # Kinds of devices that a unit has one of each


class _Stored(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Claim(_Stored):
    """How a device is recognised: by its serial number, or by its USB port where it has none."""

    usb_id: str | None = None
    serial: str | None = None
    port_path: str | None = None
    product: str = ""

    @model_validator(mode="after")
    def _recognises(self) -> Self:
        if (self.serial is None) == (self.port_path is None):
            raise ValueError("a device is recognised by a serial or by a port_path")
        return self

    def __str__(self) -> str:
        where = f"serial {self.serial}" if self.serial else f"port {self.port_path}"
        return f"{self.product or self.usb_id or 'the device'} ({where})"

    def recognises(self, device: ConnectedDevice) -> bool:
        """Return whether a connected device is the claimed one."""
        if self.usb_id is not None and device.usb_id not in (None, self.usb_id):
            return False
        if self.serial is not None:
            return device.serial == self.serial
        return device.port_path == self.port_path


class Claims(_Stored):
    """The devices of each unit, by the unit's serial; no device belongs to two units."""

    format: Literal[1] = 1
    units: Mapping[str, Mapping[DeviceKind, Claim]] = Field(default_factory=dict)

    def devices_of(self, unit: str) -> Mapping[DeviceKind, Claim]:
        """Return the devices of a unit; empty if it has none."""
        return self.units.get(unit, {})

    def unit_of(self, kind: DeviceKind, device: ConnectedDevice) -> str | None:
        """Return the unit that a connected device belongs to."""
        for unit, devices in self.units.items():
            if kind in devices and devices[kind].recognises(device):
                return unit
        return None

    def give_device(self, unit: str, kind: DeviceKind, claim: Claim) -> Claims:
        """Return the claims with a device given to a unit and taken from any other."""
        units = {
            other: {
                of_kind: held
                for of_kind, held in devices.items()
                if not (of_kind == kind and (other == unit or held == claim))
            }
            for other, devices in self.units.items()
        }
        units[unit] = {**units.get(unit, {}), kind: claim}
        return Claims(units={name: devices for name, devices in units.items() if devices})

    def remove_unit(self, unit: str) -> Claims:
        """Return the claims without those of a unit."""
        return Claims(units={name: held for name, held in self.units.items() if name != unit})


def claims_path() -> Path:
    """Return the file with the claims, in the user's data directory."""
    from platformdirs import user_data_path

    return user_data_path("tactile-core") / "claims.json"


def read_claims(path: Path | None = None) -> Claims:
    """Read the claims; none if the file does not exist.

    Raises
    ------
    InputError
        The file is damaged, or of a newer version.
    """
    path = claims_path() if path is None else path
    if not path.exists():
        return Claims()
    try:
        # [bytes] a larger file is no list of claims
        return Claims.model_validate_json(read_text(path, 1 << 20))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(
            f"{path} is no list of claims ({where}: {first['msg']}); correct it, or delete it and "
            f"claim the devices again"
        ) from None


def write_claims(claims: Claims, path: Path | None = None) -> None:
    """Write the claims, completely or not at all.

    Raises
    ------
    OSError
        The disk is full or not writable; the earlier claims remain.
    """
    path = claims_path() if path is None else path
    make_folder(path.parent)
    text = claims.model_dump_json(indent=2, exclude_none=True)
    write_atomically(path, f"{text}\n".encode())
