"""Which profiles are checked for a plugin."""

from __future__ import annotations

import pytest

from tactile_core.testing import registered
from tactile_core.testing.registered import Registered


def profiles_of(plugin: str) -> list[str]:
    return [file.path.stem for file in Registered(plugin, {}).profiles()]


def test_the_shipped_profiles_that_use_the_plugin_are_checked() -> None:
    assert profiles_of("genicam") == ["desktop_six_led", "desktop_three_colour"]


def test_a_shipped_profile_that_also_needs_a_plugin_which_is_absent_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    offers = [offer for offer in registered.installed_offers() if offer.name == "genicam"]
    monkeypatch.setattr(registered, "installed_offers", lambda: offers)
    assert profiles_of("genicam") == ["desktop_three_colour"]
