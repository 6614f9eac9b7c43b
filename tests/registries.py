"""Registries that look for the members of packages anew."""

from collections.abc import Iterator
from typing import Any

import pytest

from excite_cli.registry import Registry


def forget(registry: Registry[Any]) -> None:
    """What it has found, so that packages that came or went since are seen."""
    for each in ("members", "foreign"):
        registry.__dict__.pop(each, None)


def read_anew(registry: Registry[Any]) -> Any:
    """A fixture: every test of a file finds packages by itself."""

    @pytest.fixture(autouse=True)
    def anew() -> Iterator[None]:
        forget(registry)
        yield
        forget(registry)

    return anew
