"""On which line of a YAML text a key stands, for messages."""

from typing import Any

import yaml

from excite_cli.config.strict_yaml import composed


def line_at(text: str, path: tuple[Any, ...]) -> int | None:
    """The line, from 1, of the key or list item at `path`; None if the text does not have it.

    A path whose last key is missing (a required one) gives the line of its section.
    """
    try:
        node = composed(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None
    line: int | None = None
    for depth, part in enumerate(path):
        found = _child(node, part)
        if found is None:
            return line if depth == len(path) - 1 else None
        line, node = found
    return line


def _child(node: Any, part: Any) -> tuple[int, Any] | None:
    """Line and node of what stands under `part`."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == str(part):
                return key.start_mark.line + 1, value
    if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
        return node.value[part].start_mark.line + 1, node.value[part]
    return None
