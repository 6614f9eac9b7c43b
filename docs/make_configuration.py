"""Writes docs/configuration.md from the classes that check the YAML file.

Run: python -m docs.make_configuration
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from excite_cli.api.schema import schema_tree

TARGET = Path(__file__).parent / "configuration.md"
HEAD = """# Every key of the YAML file

Made by `python -m docs.make_configuration` from the classes in `excite_cli/config/`; a test keeps
it up to date. `excite schema` prints the same as JSON Schema, from which editors complete. Unknown
keys are errors; what is not *required* may be left out. Units are rad, s, N·m, kg and m.
"""
_NOUNS = ("number", "integer", "text", "kind", "name")
_MOST = 1e9  # beyond it any number is refused; not worth a word at every key
# Families with too many members to list at every key.
_FAMILIES = {
    "effects": "kind ([effects](effects.md))",
    "checks": "name (rows of `excite inspect`)",
}
_PLAIN = {
    "number": "number",
    "integer": "integer",
    "string": "text",
    "boolean": "true or false",
    "null": "null",
}

Schema = Mapping[str, Any]
# A section: its heading, its schema, and where it is found (name in the definitions).
Place = tuple[str, Schema]


def configuration() -> str:
    """The page as Markdown."""
    whole = schema_tree()
    places = dict(_places("", "", whole, whole["$defs"]))
    parts = [HEAD]
    for heading, schema in places.items():
        parts.append(f"\n## {heading or 'Top level'}\n\n{_paragraphs(schema)}\n")
        required = schema.get("required", ())
        for name, field in schema["properties"].items():
            inner = f"{_path(heading)}{name}"
            parts.append(_entry(name, field, name in required, _links(inner, field, whole)))
    return "\n".join(parts) + "\n"


def _entry(name: str, field: Schema, required: bool, links: str) -> str:
    """One key as an item of a list: name, meaning; then type and default on a line of their own."""
    meaning = f": {_escaped(field['description'])}" if field.get("description") else ""
    words = links or _words(field)
    default = "required" if required else _default(field)
    return f"- **`{name}`**{meaning}<br>*{words}{'; ' if default else ''}{default}*"


def _default(field: Schema) -> str:
    if "default" not in field:
        return ""
    value = field["default"]
    if value is None:
        return "none unless given"
    if isinstance(value, dict) and value:
        return "defaults there"
    plain = {True: "true", False: "false"}
    text = plain[value] if isinstance(value, bool) else str(value).replace("'", "")
    return f"default `{text}`" if value not in ({}, [], "") else "none unless given"


def _words(field: Schema) -> str:
    """What may stand there."""
    if "const" in field:
        return f"`{field['const']}`"
    if field.get("x-family") in _FAMILIES:
        return _FAMILIES[field["x-family"]]
    if "enum" in field:
        return ", ".join(f"`{value}`" for value in field["enum"])
    if "anyOf" in field:
        words = [_words(each) for each in field["anyOf"]]
        return " or ".join(word for word in dict.fromkeys(words) if word != "null")
    kind = field.get("type")
    if kind == "array":
        return _list_in_words(field)
    if kind == "object":
        return f"a mapping from names to {_plural(_words(field['additionalProperties']))}"
    return _PLAIN[str(kind)] + _range(field)


def _list_in_words(field: Schema) -> str:
    if "prefixItems" in field:
        return f"{len(field['prefixItems'])} × {_words(field['prefixItems'][0])}"
    return f"a list of {_plural(_words(field['items']))}"


def _plural(words: str) -> str:
    noun, space, rest = words.partition(" ")
    return f"{noun}s{space}{rest}" if noun in _NOUNS else words


def _range(field: Schema) -> str:
    low, above = field.get("minimum"), field.get("exclusiveMinimum")
    high = field.get("maximum")
    high = None if high is None or high >= _MOST else high
    low = None if low is None or low <= -_MOST else low
    parts = [f"at least {low:g}"] if low is not None else []
    parts += [f"above {above:g}"] if above is not None else []
    parts += [f"at most {high:,.12g}"] if high is not None else []
    return f" {' and '.join(parts)}" if parts else ""


def _places(path: str, tag: str, schema: Schema, known: Schema) -> Iterator[Place]:
    """A section and all within it."""
    yield f"{path}{tag}", schema
    for name, field in schema["properties"].items():
        inner = f"{path}.{name}" if path else name
        for found, words in _sections(field, known):
            yield from _places(inner, words, found, known)


def _sections(field: Schema, known: Schema) -> list[tuple[Schema, str]]:
    """The sections that may stand under a key, and what makes their headings differ."""
    found: list[tuple[Schema, str]] = []
    for schema, how in _references(field, known, ""):
        tag = next((f"{n}: {p['const']}" for n, p in schema["properties"].items() if "const" in p),
                   "")  # fmt: skip
        found.append((schema, "".join(f" ({word})" for word in (tag, how) if word)))
    return found


def _references(field: Schema, known: Schema, how: str) -> Iterator[tuple[Schema, str]]:
    if "$ref" in field:
        yield known[field["$ref"].rpartition("/")[2]], how
    for key in ("anyOf", "oneOf", "allOf"):
        for each in field.get(key, ()):
            yield from _references(each, known, how)
    if isinstance(field.get("items"), dict):
        yield from _references(field["items"], known, "each item of the list")
    if isinstance(field.get("additionalProperties"), dict):
        yield from _references(field["additionalProperties"], known, "each, by name")


def _links(path: str, field: Schema, whole: Schema) -> str:
    """Links to the sections that stand under a key; empty for plain values."""
    found = [f"{path}{words}" for _, words in _sections(field, whole["$defs"])]
    links = [f"[{heading}](#{slug(heading)})" for heading in found]
    plain = [each for each in field.get("anyOf", ()) if "const" in each or "enum" in each]
    return " or ".join([*(_words(each) for each in plain), *links]) if links else ""


def _path(heading: str) -> str:
    plain = heading.partition(" (")[0]
    return f"{plain}." if plain else ""


def _escaped(text: str) -> str:
    return text.replace("<", "&lt;").replace(">", "&gt;")


def _paragraphs(schema: Schema) -> str:
    return re.sub(r"[ \t]*\n[ \t]+", "\n", str(schema.get("description", "")))


def slug(heading: str) -> str:
    """The anchor that both GitHub and the site give to a heading."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


if __name__ == "__main__":
    TARGET.write_text(configuration(), encoding="utf-8")
