"""The devices that are connected, and those that belong to one unit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from tactile_core.bundles.claims import Claim, Claims, DeviceKind, read_claims, write_claims
from tactile_core.bundles.places import check_serial
from tactile_core.errors import InputError, TactileError
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.device import ConnectedDevice, Device
from tactile_core.plugins.blame import blame
from tactile_core.plugins.registry import list_plugins, resolve
from tactile_core.profiles.loader import list_profiles, load_profile
from tactile_core.profiles.model import Profile

KINDS: tuple[DeviceKind, ...] = ("camera", "light_driver")  # Kinds of components that open devices


@dataclass(frozen=True)
class ListedDevice:
    """A connected device.

    Attributes
    ----------
    kind : {"camera", "light_driver"}
    use : str
        Name of the component that opens it, such as ``core.uvc``.
    device : ConnectedDevice
    profiles : tuple of str
        Names of the profiles that would open it if it is the only device that they fit.
    unit : str or None
        Serial of the sensor unit that it belongs to.
    """

    kind: DeviceKind
    use: str
    device: ConnectedDevice
    profiles: tuple[str, ...] = ()
    unit: str | None = None


@dataclass(frozen=True)
class DeviceList:
    """What is connected.

    Attributes
    ----------
    devices : tuple of ListedDevice
    claims : Claims
        The devices of each unit, connected or not.
    notes : tuple of str
        Why some devices may be missing, and what to do.
    """

    devices: tuple[ListedDevice, ...]
    claims: Claims
    notes: tuple[str, ...]

    def is_connected(self, unit: str, kind: DeviceKind) -> bool:
        """Return whether the device that a unit has claimed is connected."""
        return any(one.kind == kind and one.unit == unit for one in self.devices)


def list_devices() -> DeviceList:
    """List what is connected and could belong to a sensor, without opening any of it.

    The search for cameras on the network takes a second.

    Raises
    ------
    InputError
        The user's claims are damaged.
    """
    claims = read_claims()
    profiles, notes = _profiles(), list[str]()
    devices = []
    for kind in KINDS:
        for use in _camera_names(kind):
            try:
                for device in _find_connected(kind, use):
                    unit = claims.unit_of(kind, device)
                    names = tuple(p.name for p in profiles if _fits(p, kind, use, device))
                    devices.append(ListedDevice(kind, use, device, names, unit))
            except TactileError as error:
                notes.append(str(error))
    return DeviceList(tuple(devices), claims, tuple(dict.fromkeys(notes)))


def shared_hubs(port_paths: Iterable[str]) -> dict[str, list[str]]:
    """Return the hubs that several devices are plugged into, each with the ports in use."""
    hubs: dict[str, list[str]] = {}
    for path in port_paths:
        hub, dot, _ = path.rpartition(".")
        if dot:  # a port without a dot is one of the computer itself
            hubs.setdefault(hub, []).append(path)
    return {hub: ports for hub, ports in hubs.items() if len(ports) > 1}


def component_of(profile: Profile, kind: DeviceKind) -> Component | None:
    """Return the component of a profile that opens a kind of device."""
    return profile.camera if kind == "camera" else profile.illumination.driver


def _find_connected(kind: DeviceKind, use: str) -> Iterator[ConnectedDevice]:
    cls: type[Device] = resolve(kind, use)
    part = f"the list of devices of {use}"
    with blame(part, cls):
        devices = iter(cls.connected())
    while True:
        with blame(part, cls):  # not around the yield: a caller's exception is no fault of it
            one = next(devices, None)
        if one is None:
            return
        yield one


def _camera_names(kind: DeviceKind) -> list[str]:
    return [f"{p.name}.{name}" for p in list_plugins() for name in p.components.get(kind, ())]


def _profiles() -> list[Profile]:
    found = []
    for entry in list_profiles():
        try:
            found.append(load_profile(entry.path, components=False))
        except TactileError:
            continue  # 'tactile validate' reports it
    return found


def _fits(profile: Profile, kind: DeviceKind, use: str, device: ConnectedDevice) -> bool:
    component = component_of(profile, kind)
    if component is None or component.use != use:
        return False
    return device.fits(component.options, resolve(kind, use).selectors)


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
            claims = claims.give_device(unit, kind, _claim(one.device, device))
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
    held = claims.devices_of(unit)
    if not held:
        raise InputError(
            f"the unit {unit!r} has claimed no device; those with claims are: "
            f"{', '.join(claims.units) or 'none'}"
        )
    write_claims(claims.remove_unit(unit))
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
    held = claims.devices_of(unit)
    update: dict[str, Any] = {}
    if "camera" in held:
        update["camera"] = _choose_claimed(profile.camera, camera, held["camera"], unit)
    else:
        update["camera"] = _choose_unclaimed(profile.camera, camera, claims, unit)
    driver = component_of(profile, "light_driver")
    if driver is not None and "light_driver" in held:
        cls = resolve("light_driver", driver.use)
        chosen = _choose_claimed(driver, cls, held["light_driver"], unit)
        update["illumination"] = profile.illumination.model_copy(update={"driver": chosen})
    return profile.model_copy(update=update)


def _choose_claimed(component: Component, cls: type[Device], claim: Claim, unit: str) -> Component:
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


def _choose_unclaimed(
    component: Component, cls: type[Device], claims: Claims, unit: str
) -> Component:
    """Choose a camera for a unit that has claimed none."""
    if not cls.selectors:
        return component
    there = [one for one in _list_connected(cls) if one.fits(component.options, cls.selectors)]
    owners = {one: claims.unit_of("camera", one) for one in there}
    for one in there:
        if one.serial == unit and owners[one] is None:
            return _choose_claimed(component, cls, _claim(one, unit), unit)
    free = [one for one in there if owners[one] is None]
    if there and not free:
        others = ", ".join(f"{one} belongs to {owners[one]!r}" for one in there)
        raise InputError(
            f"the camera of the unit {unit!r} is not connected: {others}; connect it, or claim one "
            f"with 'tactile devices --claim {unit}=DEVICE'"
        )
    if len(free) == 1 < len(there) and (free[0].serial or free[0].port_path):
        return _choose_claimed(component, cls, _claim(free[0], ""), unit)
    return component


def _list_connected(cls: type[Device]) -> Iterator[ConnectedDevice]:
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
