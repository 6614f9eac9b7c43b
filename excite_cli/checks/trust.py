"""Checks whose doubts a person has resolved: `measurement.trust: [direction of gravity]`.

A check is named as its row is. True resolves all that are judged by the dynamics.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from excite_cli.checks.check_result import CheckResult
from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError, nearest


def key_of(name: str) -> dict[str, Any]:
    """What to write in the config where the check `name` is wrong."""
    return {"measurement.trust": [name]}


def is_trusted(name: str, spec: Spec) -> bool:
    """Whether what the check `name` may find is right as it is."""
    return isinstance(spec.measurement.trust, tuple) and name in spec.measurement.trust


def but_trusted(found: Iterable[CheckResult], spec: Spec) -> list[CheckResult]:
    """Results, of which those of checks that are trusted are fine and change no config."""
    return [
        replace(
            each,
            status="ok",
            is_open=False,
            settings={},
            evidence=f"trusted (measurement.trust): {each.evidence}",
        )
        if each.status != "ok" and is_trusted(each.name, spec)
        else each
        for each in found
    ]


def check_names(spec: Spec, names: Sequence[str]) -> None:
    """Raise ConfigError where something is trusted that is no check."""
    trusted = spec.measurement.trust
    for name in trusted if isinstance(trusted, tuple) else ():
        if name not in names:
            raise ConfigError(
                f"measurement.trust: '{name}' is no check.{nearest(name, names)} Checks: "
                f"{', '.join(names)}."
            )
