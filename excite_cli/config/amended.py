"""A config with some values changed, its comments and order kept."""

import io
from collections.abc import Mapping
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

_WIDTH = 100


def amended(text: str, settings: Mapping[str, Any]) -> str:
    """YAML text with values set by the path of their key, as `measurement.angle`.

    Sections that are not there are added at the end; mappings are written on one line.
    """
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.brace_single_entry_mapping_in_flow_sequence = True
    yaml.width = _WIDTH
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
