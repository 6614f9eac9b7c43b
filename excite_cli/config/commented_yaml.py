"""Plain values as YAML text with comments beside their keys, for people to read and change."""

import io
import textwrap
from collections.abc import Mapping
from typing import Any

import yaml
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

# A config with some values changed, its comments and order kept.

_LINE_WIDTH = 100


def amended(text: str, settings: Mapping[str, Any]) -> str:
    """YAML text with values set by the path of their key, as `measurement.angle`.

    Sections that are not there are added at the end; mappings are written on one line.
    """
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.brace_single_entry_mapping_in_flow_sequence = True
    yaml.width = _LINE_WIDTH
    tree = yaml.load(text)
    for path, value in settings.items():
        *above, key = path.split(".")
        section = tree
        for name in above:
            if not isinstance(section.get(name), CommentedMap):
                section[name] = CommentedMap()
            section = section[name]
        section[key] = _on_one_line(value)
    written = io.StringIO()
    yaml.dump(tree, written)
    return written.getvalue()


def with_values(tree: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Plain values of a config with some set, by the path of their key."""
    found = dict(tree)
    for path, value in settings.items():
        name, _, rest = path.partition(".")
        old = found.get(name)
        below = old if isinstance(old, Mapping) else {}
        found[name] = with_values(below, {rest: value}) if rest else value
    return found


def changed_values(
    old: Mapping[str, Any], new: Mapping[str, Any], above: str = ""
) -> dict[str, Any]:
    """What of `new` is other than in `old`, by the path of its key.

    A section whose keys are no words of a config (names of joints) is given whole.
    """
    found: dict[str, Any] = {}
    for key, value in new.items():
        before = old.get(key)
        if key in old and before == value:
            continue
        both = isinstance(before, Mapping) and isinstance(value, Mapping)
        if both and before and all(map(str.isidentifier, {*before, *value})):
            found |= changed_values(before, value, f"{above}{key}.")
        else:
            found[above + key] = value
    return found


def _on_one_line(value: Any) -> Any:
    if isinstance(value, Mapping):
        found = CommentedMap(value)
        found.fa.set_flow_style()
        return found
    if isinstance(value, list | tuple):
        items = CommentedSeq(value)
        items.fa.set_flow_style()
        return items
    return value


_WIDTH = 100
Key = tuple[str, ...]


def commented_yaml(
    tree: Mapping[str, Any], comments: Mapping[Key, str] | None = None, header: str = ""
) -> str:
    """YAML of `tree` in its order; `comments` by the path of the key that they explain.

    A comment stands behind a value where the line has room, else above its key. Mappings are
    written in blocks as long as anything beneath has a comment or they are long, else on one line.
    """
    lines = [f"# {line}".rstrip() for line in header.splitlines()]
    return "\n".join([*lines, *_block(tree, comments or {}, (), 0)]) + "\n"


def _block(
    tree: Mapping[str, Any], comments: Mapping[Key, str], path: Key, depth: int
) -> list[str]:
    lines: list[str] = []
    indent = "  " * depth
    for key, value in tree.items():
        at = (*path, str(key))
        comment = comments.get(at, "")
        word = _flow(str(key))
        beneath = isinstance(value, Mapping) and any(
            other[: len(at)] == at and len(other) > len(at) for other in comments
        )
        flow = _flow(value)
        short = len(indent) + len(word) + 2 + len(flow) <= _WIDTH
        if isinstance(value, Mapping) and value and (beneath or not short):
            lines += _above(comment, indent)
            lines.append(f"{indent}{word}:")
            lines += _block(value, comments, at, depth + 1)
            continue
        if not short and isinstance(value, list | tuple):
            lines += _above(comment, indent)
            lines.append(f"{indent}{word}: [")
            lines += _packed([_flow(item) for item in value], f"{indent}  ")
            lines.append(f"{indent}]")
            continue
        line = f"{indent}{word}: {flow}"
        if comment and len(line) + 4 + len(comment) <= _WIDTH and "\n" not in comment:
            lines.append(f"{line}  # {comment}")
        else:
            lines += [*_above(comment, indent), line]
    return lines


def _packed(items: list[str], indent: str) -> list[str]:
    """Items with commas, as many to a line as there is room for."""
    lines: list[str] = []
    for place, item in enumerate(items):
        word = item if place == len(items) - 1 else f"{item},"
        if lines and len(lines[-1]) + 1 + len(word) <= _WIDTH:
            lines[-1] += f" {word}"
        else:
            lines.append(f"{indent}{word}")
    return lines


def _flow(value: Any) -> str:
    """A value on one line."""
    text = yaml.safe_dump(
        value, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**9
    )
    return text.removesuffix("...\n").strip()


def _above(comment: str, indent: str) -> list[str]:
    return [
        f"{indent}# {line}"
        for part in comment.splitlines()
        for line in textwrap.wrap(part, _WIDTH - len(indent) - 2)
    ]
