"""The JSON schema of profiles, for editors."""

from __future__ import annotations

from typing import Any

from tactile_core.profiles.model import Profile

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
