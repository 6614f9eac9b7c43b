"""The JSON Schema of the YAML problem, for editors: `excite schema`."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.config.spec import Spec
from excite_cli.shown.answer import Answer


def schema_tree() -> dict[str, Any]:
    """The schema, with the names of a family's members where a text (`x-family`) is one of them."""
    from excite_cli.checks.all_checks import row_names
    from excite_cli.constraints.catalogue import own_constraints, settings_of
    from excite_cli.criteria.catalogue import CRITERIA
    from excite_cli.effects.catalogue import EFFECTS
    from excite_cli.measurement.torque_sources.catalogue import TORQUE_SOURCES

    own = {}
    for name, found in own_constraints().items():
        settings = settings_of(found)
        keys = {each.name: {"type": "number"} for each in settings}
        needed = [each.name for each in settings if each.default is each.empty]
        own[name] = {"type": "object", "properties": keys, "required": needed}
    names = {
        "effects": EFFECTS.names,
        "criteria": CRITERIA.names,
        "checks": [*row_names()],
        "torque_sources": TORQUE_SOURCES.names,
    }
    whole = Spec.model_json_schema()
    for node in _nodes(whole):
        family = node.get("x-family")
        if family == "constraints":
            node["properties"] = own
        elif family is not None:
            node["enum"] = names[family]
    return whole


def _nodes(tree: Any) -> Iterator[dict[str, Any]]:
    """All mappings in a schema."""
    if isinstance(tree, dict):
        yield tree
    for each in tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ():
        yield from _nodes(each)


def words_at(path: Sequence[str]) -> tuple[list[str], list[str]]:
    """What may stand at a place of the config: keys of a section, and names to choose from."""
    whole = schema_tree()
    found = [whole]
    for part in path:
        inside = [each.get("properties", {}) for each in _meant(found, whole["$defs"])]
        found = [each[part] for each in inside if part in each]
    there = list(_meant(found, whole["$defs"]))
    keys = [key for each in there for key in each.get("properties", ())]
    return keys, [str(name) for each in there for name in each.get("enum", ())]


def _meant(schemas: Sequence[Any], known: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The schemas and all that they refer to, or of which they are one or a list."""
    for each in schemas:
        yield each
        inner = [*each.get("anyOf", ()), *each.get("oneOf", ())]
        inner += [each["items"]] if isinstance(each.get("items"), dict) else []
        inner += [known[each["$ref"].rpartition("/")[2]]] if "$ref" in each else []
        yield from _meant(inner, known)


def config_schema() -> str:
    """The schema as JSON text."""
    return json.dumps(schema_tree(), indent=2, ensure_ascii=False)


@checked()
def save_schema(path: str | Path, overwrite: bool = False) -> Answer:
    """Write the schema; what is returned says how an editor finds it.

    Raises
    ------
    FileError
        The file exists, or cannot be written.
    """
    with held({"output": path}, overwrite):
        write_text_atomically(Path(path), config_schema() + "\n")
    hint = f"First line of a config: # yaml-language-server: $schema={path}"
    return Answer((str(path), hint), {"output": str(path)})
