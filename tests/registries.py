"""Registries that look for the members of packages anew."""

from typing import Any

from excite_cli.registry import Registry


def forget(registry: Registry[Any]) -> None:
    """What it has found, so that packages that came or went since are seen."""
    for each in ("members", "foreign"):
        registry.__dict__.pop(each, None)
