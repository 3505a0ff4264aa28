"""The profile's model: the sections of its YAML file, and their JSON schema."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tactile_core.formats.text import shorten_repr
from tactile_core.interfaces.artefact import Section
from tactile_core.interfaces.component import Component, Lighting
from tactile_core.interfaces.gel import Gel, Optics, markers_misfit
from tactile_core.interfaces.image import ImageSection

_NAME = r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}$"


def _check_name(text: str) -> str:
    if not re.fullmatch(_NAME, text):
        raise ValueError(
            f"should consist of up to 100 letters, digits, '_', '.' and '-' and not begin with "
            f"'.' or '-', not {shorten_repr(text)}"
        )
    return text


class Profile(Section):
    """One sensor build."""

    schema_version: Literal[1] = Field(alias="schema", description="Format of this file: 1.")
    name: Annotated[str, AfterValidator(_check_name)] = Field(
        description="The profile's name.", json_schema_extra={"pattern": _NAME}
    )
    revision: str = Field(default="", description="Revision of the build.")
    description: str = Field(default="", description="One sentence about the build.")
    image: ImageSection = Field(
        description="The rectified image in which all quantities are measured."
    )
    gel: Gel = Field(default_factory=Gel, description="The elastomer and its markers.")
    camera: Component = Field(
        default_factory=lambda: Component(use="core.replay"), description="The source of images."
    )
    illumination: Lighting = Field(
        default_factory=lambda: Lighting(use="core.constant"),
        description="The lights, and the exposures of one observation.",
    )
    calibration: Component = Field(
        default_factory=lambda: Component(use="core.automatic"),
        description="The calibrator: 'tactile calibrate' fits its model of intensity to slope.",
    )
    starting_bundle: Path | None = Field(
        default=None,
        description="Folder of the starting calibration, relative to this file: it measures a "
        "unit coarsely before that is calibrated.",
    )
    estimators: dict[str, Component] = Field(
        default_factory=dict, description="The steps after the calibration, in order."
    )
    sinks: dict[str, Component] = Field(
        default_factory=dict,
        description="Destinations of readings, with options; 'tactile run --save' selects them.",
    )
    optics: Optics = Field(
        default_factory=Optics,
        description="Construction of lights, coating and camera, for the virtual sensor.",
    )
    sim: dict[str, Any] = Field(
        default_factory=dict, description="Overlay of this profile for its virtual sensor."
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
        """All components by key: ``camera``, …, ``estimators.height``."""
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


_EXTENDS = {
    "type": ["string", "null"],
    "description": "Name of a profile, or a path relative to this file, whose keys are inherited.",
}


def profile_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a profile's file.

    ``null`` resets any key to its default, so it is allowed everywhere. A revision may omit what
    it inherits, so keys are required only if ``extends`` is absent. The schema does not restrict
    a component's own options.
    """
    schema = Profile.model_json_schema(by_alias=True)
    sections: dict[str, Any] = schema.pop("$defs")
    required = {"": schema.pop("required")}
    required |= {name: one.pop("required", []) for name, one in sections.items()}
    for section in (schema, *sections.values()):
        section["properties"] = {k: _or_null(v) for k, v in section["properties"].items()}
    properties = schema["properties"]
    overlaid = [key for key in properties if key not in ("schema", "name", "sim")]
    properties["sim"]["anyOf"][0].update(
        properties={key: {"$ref": f"#/properties/{key}"} for key in overlaid},
        additionalProperties=False,
    )
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "Profile of a tactile sensor",
        "properties": {"extends": _EXTENDS, **properties},
        "if": {"not": {"required": ["extends"]}},
        "then": {
            "required": required[""],
            "properties": {"image": {"required": required["ImageSection"]}},
        },
        "$defs": sections,
    }


def _or_null(value: dict[str, Any]) -> dict[str, Any]:
    kept: dict[str, Any] = {key: value[key] for key in ("description", "default") if key in value}
    rest = {k: v for k, v in value.items() if k not in (*kept, "title")}
    alternatives = rest.get("anyOf", [rest])
    if {"type": "null"} not in alternatives:
        alternatives = [*alternatives, {"type": "null"}]
    return {"anyOf": alternatives, **kept}
