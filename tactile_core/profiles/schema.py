"""The JSON schema of profiles, for editors."""

from __future__ import annotations

from typing import Any

from tactile_core.profiles.model import Profile


def profile_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a profile's file.

    A revision may leave out what it inherits, and ``null`` resets any key, so nothing is required
    where ``extends`` stands.
    """
    schema = Profile.model_json_schema(by_alias=True)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["properties"]["extends"] = {
        "type": "string",
        "description": "A profile's name, or a path relative to this file.",
    }
    for model in (schema, *schema["$defs"].values()):
        for name, value in model.get("properties", {}).items():
            if name != "extends":
                model["properties"][name] = _or_null(value)
    required = schema.pop("required")
    schema["if"] = {"not": {"required": ["extends"]}}
    schema["then"] = {"required": required}
    for name in ("ImageSection", "Gel"):
        # A revision names only what differs.
        schema["$defs"][name].pop("required", None)
    return schema


def _or_null(value: dict[str, Any]) -> dict[str, Any]:
    kept: dict[str, Any] = {key: value[key] for key in ("description", "default") if key in value}
    rest = {key: v for key, v in value.items() if key not in kept}
    return {"anyOf": [rest, {"type": "null"}], **kept}
