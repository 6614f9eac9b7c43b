"""Plain values as YAML text with comments beside their keys, for people to read and change."""

import textwrap
from collections.abc import Mapping
from typing import Any

import yaml

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
