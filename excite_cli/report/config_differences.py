"""Which keys of several configs differ, with their values."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from excite_cli.config.load import parse_spec
from excite_cli.report.page import Block, Table, Text

_LONGEST = 80


def differences(names: Sequence[str], configs: Sequence[str]) -> Block:
    """A table of the keys (`constraints.torque.scale`) that are not the same in all `configs`.

    Parameters
    ----------
    names
        What each config belongs to, for the columns.
    configs
        Resolved problems as YAML text.

    Raises
    ------
    ConfigError
        A text is no config.
    """
    flat = [
        flattened(parse_spec(text, f"the config of {name}").model_dump(mode="json"))
        for name, text in zip(names, configs, strict=True)
    ]
    keys = dict.fromkeys(key for values in flat for key in values)
    rows = [(key, *(_said(values, key) for values in flat)) for key in keys]
    differing = tuple(row for row in rows if len(set(row[1:])) > 1)
    if not differing:
        return Text("The configs are the same, key by key.")
    return Table(("key", *names), differing, title="What differs in the configs")


def flattened(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Leaves of nested mappings by their dotted paths; lists count as leaves."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping) and value:
            found |= flattened(value, f"{path}.")
        else:
            found[path] = value
    return found


def _said(values: Mapping[str, Any], key: str) -> str:
    if key not in values:
        return "–"
    text = json.dumps(values[key], ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
