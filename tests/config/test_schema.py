"""The JSON Schema for editors has the keys of the typed spec and is well formed."""

import json
from typing import Any

import pytest

from excite_cli.cli.schema import schema as print_schema
from excite_cli.config import spec as sections
from excite_cli.config.load import parse_spec

KEYWORDS = {
    "$defs", "$ref", "additionalProperties", "anyOf", "const", "default", "description",
    "discriminator", "enum", "exclusiveMaximum", "exclusiveMinimum", "items", "maxItems", "maximum",
    "maxLength", "minItems", "minLength", "minimum", "oneOf", "pattern", "prefixItems",
    "properties", "propertyNames", "required", "title", "type", "uniqueItems",
}  # fmt: skip
TYPES = {"array", "boolean", "integer", "null", "number", "object", "string"}


@pytest.fixture
def schema(capsys: pytest.CaptureFixture[str]) -> Any:
    print_schema()
    return json.loads(capsys.readouterr().out)


def check(node: Any, root: Any) -> int:
    """Assert that `node` is a JSON Schema; return the number of nodes below."""
    if isinstance(node, bool):
        return 1
    assert isinstance(node, dict)
    assert set(node) <= KEYWORDS, f"not keywords of JSON Schema: {set(node) - KEYWORDS}"
    if "type" in node:
        assert node["type"] in TYPES
    if "$ref" in node:
        assert node["$ref"].removeprefix("#/$defs/") in root["$defs"]
    if "required" in node:
        assert set(node["required"]) <= set(node["properties"])
    if "enum" in node:
        assert node["enum"]
    inner = [*node.get("$defs", {}).values(), *node.get("properties", {}).values()]
    for word in ("anyOf", "oneOf", "prefixItems"):
        assert node.get(word, [True]), f"{word} is empty"
        inner += node.get(word, [])
    inner += [node[word] for word in ("items", "additionalProperties") if word in node]
    return 1 + sum(check(part, root) for part in inner)


def test_it_is_well_formed(schema: Any) -> None:
    assert check(schema, schema) > 100


def test_it_has_the_keys_of_every_section(schema: Any) -> None:
    assert set(schema["properties"]) == set(sections.Spec.model_fields)
    assert schema["required"] == ["robot"]
    for section in sections.Section.__subclasses__():
        if section is sections.Spec:
            continue
        described = schema["$defs"][section.__name__]
        assert set(described["properties"]) == set(section.model_fields)
        needed = {name for name, field in section.model_fields.items() if field.is_required()}
        assert set(described.get("required", [])) == needed


def test_unknown_keys_are_refused_by_the_schema_as_by_the_program(schema: Any) -> None:
    for described in [schema, *schema["$defs"].values()]:
        assert described["additionalProperties"] is False


def test_its_defaults_are_those_of_the_program(schema: Any) -> None:
    resolved = parse_spec("robot: {urdf: a.urdf}").model_dump(mode="json")
    for name, described in schema["properties"].items():
        if "default" in described:
            assert described["default"] == resolved[name]
