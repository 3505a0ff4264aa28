"""What a profile may say: one sensor build, part by part.

Stage one of validation: these models need no plugin. A component's own options are checked by the
component's ``Options`` in stage two.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tactile_core.formats.printable import shown
from tactile_core.interfaces.component import Component, Lighting
from tactile_core.interfaces.gel import Gel, markers_misfit
from tactile_core.interfaces.image import ImageSection
from tactile_core.interfaces.optics import Optics
from tactile_core.interfaces.section import Section

_NAME = r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}$"


def _named(text: str) -> str:
    if not re.fullmatch(_NAME, text):
        raise ValueError(
            f"should be up to 100 letters, digits, '_', '.' and '-', and not begin with '.' or "
            f"'-', not {shown(text)}"
        )
    return text


class Profile(Section):
    """One sensor build."""

    schema_version: Literal[1] = Field(alias="schema", description="Format of this file: 1.")
    name: Annotated[str, AfterValidator(_named)] = Field(
        description="The profile's name.", json_schema_extra={"pattern": _NAME}
    )
    revision: str = Field(default="", description="Which revision of the build.")
    description: str = Field(default="", description="One sentence for people.")
    image: ImageSection = Field(description="The image in which everything is measured.")
    gel: Gel = Field(default_factory=Gel, description="The elastomer and its markers.")
    camera: Component = Field(
        default_factory=lambda: Component(use="core.replay"), description="What takes images."
    )
    illumination: Lighting = Field(
        default_factory=lambda: Lighting(use="core.constant"),
        description="The lights, and how one observation is exposed.",
    )
    calibration: Component = Field(
        default_factory=lambda: Component(use="core.automatic"),
        description="The model from intensities to slopes that 'tactile calibrate' fits.",
    )
    estimators: dict[str, Component] = Field(
        default_factory=dict, description="The steps after the calibration, in order."
    )
    sinks: dict[str, Component] = Field(
        default_factory=dict,
        description="Where readings may go, with options; 'tactile run --save' names them.",
    )
    optics: Optics = Field(
        default_factory=Optics, description="Light beyond the lamps' places, for the virtual twin."
    )
    sim: dict[str, Any] = Field(
        default_factory=dict, description="Overlay of this profile for its virtual twin."
    )

    @field_validator("gel")
    @classmethod
    def _markers_fit_the_image(cls, gel: Gel, info: ValidationInfo) -> Gel:
        image = info.data.get("image")
        misfit = None if image is None else markers_misfit(gel, image)
        if misfit is not None:
            raise ValueError(misfit)
        return gel

    @property
    def components(self) -> Mapping[str, Component]:
        """Every component by the key that names it: ``camera``, …, ``estimators.height``."""
        driver = self.illumination.driver
        steps = {f"estimators.{name}": step for name, step in self.estimators.items()}
        sinks = {f"sinks.{name}": sink for name, sink in self.sinks.items()}
        return {
            "camera": self.camera,
            "illumination": self.illumination,
            **({} if driver is None else {"illumination.driver": driver}),
            "calibration": self.calibration,
            **steps,
            **sinks,
        }
