"""The JSON schema describes the keys of a profile's YAML."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from tactile_core.profiles.model import Profile, profile_schema


def sections() -> Iterator[dict[str, Any]]:
    schema = profile_schema()
    yield schema
    yield from schema["$defs"].values()


def test_its_keys_are_those_of_a_profile() -> None:
    keys = set(profile_schema()["properties"])
    assert keys == {field.alias or name for name, field in Profile.model_fields.items()} | {
        "extends"
    }


def test_every_key_is_described() -> None:
    for section in sections():
        assert [
            key for key, value in section["properties"].items() if not value["description"]
        ] == []


def test_every_key_accepts_null() -> None:
    for section in sections():
        for value in section["properties"].values():
            assert {"type": "null"} in value.get("anyOf", ()) or "null" in value["type"]


def test_a_revision_can_omit_inherited_keys() -> None:
    assert not any("required" in section for section in sections())
    assert profile_schema()["if"] == {"not": {"required": ["extends"]}}
    assert profile_schema()["then"]["required"] == ["schema", "name", "image"]


def test_every_reference_resolves() -> None:
    schema = profile_schema()

    def references(value: Any) -> Iterator[str]:
        if isinstance(value, dict):
            yield from [value["$ref"]] if "$ref" in value else []
            value = list(value.values())
        if isinstance(value, list):
            for item in value:
                yield from references(item)

    for reference in references(schema):
        target = schema
        for part in reference.removeprefix("#/").split("/"):
            target = target[part]


def test_the_schema_is_valid_json() -> None:
    assert json.loads(json.dumps(profile_schema())) == profile_schema()
