"""Lists the connected cameras and light boxes, with the profiles and the unit of each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from tactile_core.bundles.claims import Claims, DeviceKind, read_claims
from tactile_core.errors import TactileError
from tactile_core.interfaces.component import Component
from tactile_core.interfaces.connected_device import ConnectedDevice
from tactile_core.interfaces.device import Device
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
        for use in _names(kind):
            try:
                for device in _connected(kind, use):
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


def _connected(kind: DeviceKind, use: str) -> Iterator[ConnectedDevice]:
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


def _names(kind: DeviceKind) -> list[str]:
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
