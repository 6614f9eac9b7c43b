"""Finer shapes around those that were found: a grid names an effect, it does not measure it."""

from collections.abc import Sequence

from excite_cli.effects.base import Effect, Signals


def shapes_around(effect: Effect, signals: Sequence[Signals]) -> list[dict]:
    """The effect's shape and neighbours of it, far and near, one parameter changed at a time."""
    found = [dict(effect.shape)]
    for name, value in effect.shape.items():
        found += [
            {**effect.shape, name: float(value + sign * change)}
            for change in effect.finer_steps(name, signals)
            for sign in (-1.0, 1.0)
        ]
    return found
