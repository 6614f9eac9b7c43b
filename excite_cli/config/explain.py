"""What pydantic found wrong with a config, in words for the person who wrote it.

Errors carry a location in the model, with labels of union branches mixed into the keys. The path
reported is that of the file: labels are dropped by walking the given tree along it. Branches of one
union that all fail are reported as one list of what is allowed.
"""

import math
from collections.abc import Callable
from typing import Any

from pydantic import ValidationError

from excite_cli.config.section import Section
from excite_cli.config.spec import Spec
from excite_cli.errors import nearest

_ALLOWED = {
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "int_parsing": "an integer",
    "int_type": "an integer",
    "int_from_float": "an integer",
    "float_parsing": "a number",
    "float_type": "a number",
    "finite_number": "a finite number",
    "string_type": "text",
    "tuple_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "none_required": "null",
}
_BOUNDS = {
    "greater_than": ("gt", "a number greater than {}"),
    "greater_than_equal": ("ge", "a number greater than or equal to {}"),
    "less_than": ("lt", "a number less than {}"),
    "less_than_equal": ("le", "a number less than or equal to {}"),
}

_MOST = 20  # places that are told
_LONGEST = 120  # characters of what was given
_LONGEST_WHOLE = 10**100

Path = tuple[Any, ...]


def explain(
    error: ValidationError, tree: Any, source: str, line_of: Callable[[Path], int | None]
) -> str:
    """One line for each wrong place: where, what is wrong, what is allowed.

    `line_of` tells the line of the file on which a path stands, None for what is not in it.
    """
    found: dict[Path, list[Any]] = {}
    for item in error.errors(include_url=False):
        found.setdefault(_path_in_file(item, tree), []).append(item)
    # Where something inside a value is wrong, what the value might have been instead is noise.
    outer = {path[:length] for path in found for length in range(len(path))}
    deepest = [path for path in found if path not in outer]
    told = []
    for path in deepest[:_MOST]:
        line = line_of(path)
        where = source if line is None else f"{source}, line {line}"
        told.append(f"{where}: {_named(path)}: {_reason(found[path], path, tree)}")
    if len(deepest) > _MOST:
        told.append(f"{source}: and {len(deepest) - _MOST} more.")
    return "\n".join(told)


def _path_in_file(item: Any, tree: Any) -> Path:
    """Location without labels of union branches."""
    path: list[Any] = []
    node = tree
    parts = item["loc"]
    for position, part in enumerate(parts):
        last = position == len(parts) - 1
        known = isinstance(node, dict) and part in node
        if not known and isinstance(node, list) and isinstance(part, int):
            known = part < len(node)
        if known:
            path.append(part)
            node = node[part]
        elif last and item["type"] == "missing" and not isinstance(node, list):
            path.append(part)
    return tuple(path)


def _named(path: Path) -> str:
    return _short(".".join(_short(str(part)) for part in path)) or "the file"


def _short(text: str) -> str:
    """What a person reads of a word that is far too long."""
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}… ({len(text)} characters)"


def _reason(items: list[Any], path: Path, tree: Any) -> str:
    kinds = [item["type"] for item in items]
    if "extra_forbidden" in kinds:
        allowed = _keys_at(path[:-1], tree)
        word = str(path[-1])
        return f"unknown key.{nearest(word, allowed)} Allowed here: {', '.join(allowed)}."
    if "missing" in kinds:
        given = _at(path, tree)
        if isinstance(given, list):  # the place of a number in a list is no key
            count = max(item["loc"][-1] for item in items if item["type"] == "missing") + 1
            return f"{_count(count)} needed (given: {len(given)})."
        return "this key is required."
    for item in items:
        if item["type"].startswith("union_tag"):
            return _wrong_tag(item)
        if item["type"] == "value_error":
            return f"{item['msg'].removeprefix('Value error, ')}{_given(item)}."
    allowed_here = list(dict.fromkeys(_allowed(item) for item in items))
    words = [word for item in items for word in _literals(item)]
    given = items[0].get("input")
    hint = nearest(given, words) if isinstance(given, str) else ""
    return f"allowed: {' or '.join(allowed_here)}{_given(items[0])}.{hint}"


def _wrong_tag(item: Any) -> str:
    context = item["ctx"]
    key = str(context["discriminator"]).strip("'")
    if item["type"] == "union_tag_not_found":
        return f"give '{key}' to say which kind is meant."
    expected = context["expected_tags"].replace("'", "")
    tag = str(context["tag"])
    return f"unknown kind '{_short(tag)}'.{nearest(tag, expected.split(', '))} Allowed: {expected}."


def _allowed(item: Any) -> str:
    kind, context = item["type"], item.get("ctx", {})
    if kind == "literal_error":
        return str(context["expected"])
    if isinstance(item.get("input"), float) and not math.isfinite(item["input"]):
        return _ALLOWED["finite_number"]
    if kind in _BOUNDS:
        name, words = _BOUNDS[kind]
        return words.format(f"{context[name]:.10g}")
    if kind == "too_long" and isinstance(item.get("input"), list | tuple):
        most = context.get("max_length")
        return f"{_count(most)} (given: {len(item['input'])})"
    if kind in ("too_short", "too_long"):
        limit = context.get("min_length", context.get("max_length"))
        return f"{'at least' if kind == 'too_short' else 'at most'} {limit} values"
    if kind in _ALLOWED:
        return _ALLOWED[kind]
    return str(item["msg"])


def _count(count: int) -> str:
    return f"{count} value{'' if count == 1 else 's'}"


def _at(path: Path, tree: Any) -> Any:
    """What the file says at `path`; None where it says nothing."""
    node = tree
    for part in path:
        try:
            node = node[part]
        except (KeyError, IndexError, TypeError):
            return None
    return node


def _literals(item: Any) -> list[str]:
    if item["type"] != "literal_error":
        return []
    text = str(item["ctx"]["expected"]).replace(" or ", ", ")
    return [word.strip("'") for word in text.split(", ")]


def _given(item: Any) -> str:
    value = item.get("input")
    if not isinstance(value, str | int | float | bool | None):
        return ""
    long = isinstance(value, int) and abs(value) > _LONGEST_WHOLE  # Python refuses to print those
    return f" (given: {'a huge number' if long else _short(repr(value))})"


def _keys_at(path: Path, tree: Any) -> list[str]:
    """Keys of the section at `path`, of the kind that the file asks for there."""
    node: Any = tree
    section: type[Section] = Spec
    for part in path:
        node = node[part]
        section = section.child(part, node) or section
    return sorted(section.model_fields)
