"""The camera and the light box of one sensor unit: claimed, forgotten, and put into its profile."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from tactile_core.acquisition.device_list import (
    KINDS,
    ListedDevice,
    component_of,
    list_devices,
)
from tactile_core.bundles.bundle import check_serial
from tactile_core.bundles.claims import Claim, Claims, DeviceKind, read_claims, write_claims
from tactile_core.errors import InputError, TactileError
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.connected_device import ConnectedDevice
from tactile_core.interfaces.device import Device
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.model import Profile

# Kinds of devices in messages.
IN_WORDS: Mapping[DeviceKind, str] = {"camera": "camera", "light_driver": "light box"}


def claim_device(unit: str, device: str) -> tuple[ListedDevice, ...]:
    """Remember that a connected camera or light box belongs to a sensor unit.

    A unit has one camera and one light box: an earlier claim of the same kind is replaced, and the
    device is taken from another unit. ``open_sensor(…, serial=unit)`` opens it from then on.

    Parameters
    ----------
    unit : str
        Serial of the sensor unit.
    device : str
        Serial number, USB port or device file of the device. It is remembered by its serial number,
        unless it has none or is named by its port.

    Returns
    -------
    tuple of ListedDevice
        One device, or a camera and a light box with one serial number.

    Raises
    ------
    InputError
        The unit's serial is not usable, the claims are damaged, no connected device has this name,
        or several of a kind have it.
    OSError
        The claims cannot be written.
    """
    check_serial(unit)
    listed = list_devices()
    found = [one for one in listed.devices if device in _names(one.device)]
    if not found:
        there = ", ".join(sorted({str(one.device) for one in listed.devices})) or "none"
        raise InputError(
            f"no connected camera or light box has the serial number or port {device!r}; connected "
            f"are: {there}; plug it in, or take a name from 'tactile devices'"
        )
    claims, chosen = listed.claims, []
    for kind in KINDS:
        # several components may be able to open one device
        same = {(one.device.serial, one.device.port_path): one for one in found if one.kind == kind}
        if len(same) > 1:
            alike = ", ".join(str(one.device) for one in same.values())
            raise InputError(f"{device!r} names several devices: {alike}; name one by its port")
        for one in same.values():
            claims = claims.given(unit, kind, _claim(one.device, device))
            chosen.append(one)
    write_claims(claims)
    return tuple(chosen)


def forget_devices(unit: str) -> Mapping[DeviceKind, Claim]:
    """Forget the camera and the light box of a unit, and return them.

    Raises
    ------
    InputError
        The unit has claimed none, or the claims are damaged.
    OSError
        The claims cannot be written.
    """
    claims = read_claims()
    held = claims.of(unit)
    if not held:
        raise InputError(
            f"the unit {unit!r} has claimed no device; those with claims are: "
            f"{', '.join(claims.units) or 'none'}"
        )
    write_claims(claims.without(unit))
    return held


def with_unit_devices(profile: Profile, unit: str) -> Profile:
    """Return the profile with the camera and the light box of a unit.

    These are the devices that the unit has claimed. Without a claimed camera, it is a connected one
    whose serial number is the unit's serial, or the only one that the profile fits and no other
    unit has claimed; else the profile stays as it is. A recording or virtual sensor has no devices.

    Raises
    ------
    InputError
        The claims are damaged, or every connected camera that fits belongs to another unit.
    """
    camera = resolve("camera", profile.camera.use)
    if not camera.live:
        return profile
    claims = read_claims()
    held = claims.of(unit)
    update: dict[str, Any] = {}
    if "camera" in held:
        update["camera"] = _claimed(profile.camera, camera, held["camera"], unit)
    else:
        update["camera"] = _unclaimed(profile.camera, camera, claims, unit)
    driver = component_of(profile, "light_driver")
    if driver is not None and "light_driver" in held:
        cls = resolve("light_driver", driver.use)
        chosen = _claimed(driver, cls, held["light_driver"], unit)
        update["illumination"] = profile.illumination.model_copy(update={"driver": chosen})
    return profile.model_copy(update=update)


def _claimed(component: Component, cls: type[Device], claim: Claim, unit: str) -> Component:
    """Return the component with the options that choose the claimed device."""
    attribute = "port_path" if claim.serial is None else "serial"
    options = {of: option for option, of in cls.selectors.items()}
    if attribute not in options:
        raise InputError(
            f"the unit {unit!r} has claimed {claim}, but {component.use} cannot choose a device by "
            f"its {attribute.partition('_')[0]}; forget the claim with 'tactile devices --forget "
            f"{unit}', or correct the profile"
        )
    chosen = {options[attribute]: getattr(claim, attribute)}
    if claim.usb_id is not None and "usb_id" in options:
        chosen[options["usb_id"]] = claim.usb_id
    kept = {key: value for key, value in component.options.items() if key not in cls.selectors}
    return Component.model_validate({"use": component.use, **kept, **chosen})


def _unclaimed(component: Component, cls: type[Device], claims: Claims, unit: str) -> Component:
    """Choose a camera for a unit that has claimed none."""
    if not cls.selectors:
        return component
    there = [one for one in _listed(cls) if one.fits(component.options, cls.selectors)]
    owners = {one: claims.unit_of("camera", one) for one in there}
    for one in there:
        if one.serial == unit and owners[one] is None:
            return _claimed(component, cls, _claim(one, unit), unit)
    free = [one for one in there if owners[one] is None]
    if there and not free:
        others = ", ".join(f"{one} belongs to {owners[one]!r}" for one in there)
        raise InputError(
            f"the camera of the unit {unit!r} is not connected: {others}; connect it, or claim one "
            f"with 'tactile devices --claim {unit}=DEVICE'"
        )
    if len(free) == 1 < len(there) and (free[0].serial or free[0].port_path):
        return _claimed(component, cls, _claim(free[0], ""), unit)
    return component


def _listed(cls: type[Device]) -> Iterator[ConnectedDevice]:
    with suppress(TactileError):  # opening the camera explains what is missing
        yield from cls.connected()


def _claim(device: ConnectedDevice, name: str) -> Claim:
    """Return how a device is recognised that the user calls by a name."""
    by_port = name == device.port_path or device.serial is None
    if by_port and device.port_path is None:
        raise InputError(
            f"{device} has neither a serial number nor a USB port, so it cannot be claimed; "
            f"connect one of its kind at a time"
        )
    return Claim(
        usb_id=device.usb_id,
        serial=None if by_port else device.serial,
        port_path=device.port_path if by_port else None,
        product=device.product,
    )


def _names(device: ConnectedDevice) -> tuple[str | None, ...]:
    return device.serial, device.port_path, device.place or None
