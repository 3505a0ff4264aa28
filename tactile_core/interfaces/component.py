"""Components of a sensor as a profile names them, and what a component can see of the sensor."""

from __future__ import annotations

import re
from typing import Annotated, Any, Protocol

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from tactile_core.formats.text import shorten_repr
from tactile_core.interfaces.gel import Gel, Optics
from tactile_core.interfaces.image import ImageSection

# Components of the distribution tactile-sim, for whoever needs a virtual sensor.
SIMULATOR = "sim.virtual"
VIRTUAL_CAMERA = "sim.virtual"  # plays a script
HAND_CAMERA = "sim.hand"  # people press it

_USE = r"^[A-Za-z_][A-Za-z0-9_-]*\.[A-Za-z_][A-Za-z0-9_]*$"


def is_component_name(text: str) -> bool:
    """Whether a text is plugin.name."""
    return re.fullmatch(_USE, text) is not None


def _component_named(text: str) -> str:
    if not is_component_name(text):
        raise ValueError(
            f"should be plugin.name, as 'tactile plugins' lists it, not {shorten_repr(text)}"
        )
    return text


class Component(BaseModel):
    """A component that a plugin provides: ``use: plugin.name`` and the component's options."""

    model_config = ConfigDict(extra="allow", frozen=True)

    use: Annotated[str, AfterValidator(_component_named)] = Field(
        description="The component's name, plugin.name.", json_schema_extra={"pattern": _USE}
    )

    @model_validator(mode="before")
    @classmethod
    def _is_a_mapping(cls, value: Any) -> Any:
        if isinstance(value, str):
            raise ValueError(f"should be a mapping; write {{use: {value}}}")
        return value

    @property
    def options(self) -> dict[str, Any]:
        """The keys beside ``use``; the component's own ``Options`` check them."""
        return dict(self.model_extra or {})


class Lighting(Component):
    """An illumination, and the device that switches its lights."""

    driver: Component | None = Field(
        default=None,
        description="The component that switches the lights; used only with a live camera.",
    )


class GelImage(Protocol):
    """A gel and its image: a profile, or the context of a step."""

    @property
    def gel(self) -> Gel:
        """The elastomer and its markers."""

    @property
    def image(self) -> ImageSection:
        """The rectified image in which all quantities are measured."""


class SensorBuild(GelImage, Protocol):
    """The part of a profile that its components can see."""

    @property
    def name(self) -> str:
        """The profile's name."""

    @property
    def illumination(self) -> Lighting:
        """The lights, and how one observation is exposed."""

    @property
    def optics(self) -> Optics:
        """Lights, coating and camera of the virtual sensor."""
