"""What is connected, as one list."""

from tactile_core.acquisition.unit_devices import shared_hubs


def test_devices_on_one_hub_are_listed_together() -> None:
    ports = ("1-1", "1-2", "1-3.1", "1-3.4", "2-3.1", "1-3.2.1", "1-3.2.4")
    assert shared_hubs(ports) == {"1-3": ["1-3.1", "1-3.4"], "1-3.2": ["1-3.2.1", "1-3.2.4"]}
