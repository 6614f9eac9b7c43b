"""Finer shapes around those that were found: a grid names an effect, it does not measure it."""

from collections.abc import Sequence

from excite_cli.effects.base import Effect, Signals


def shapes_around(effect: Effect, signals: Sequence[Signals]) -> list[dict]:
    """The effect's shape and neighbours of it, far and near, one parameter changed at a time.

    Of a shape that is one of few (a power, a direction) all others: what was found first may have
    stood for something that is in by now.
    """
    found = [dict(effect.shape)]
    for name, value in effect.shape.items():
        found += [
            {**effect.shape, name: float(value + sign * change)}
            for change in effect.finer_steps(name, signals)
            for sign in (-1.0, 1.0)
        ]
    if len(found) > 1:
        return found
    if effect.covariate:
        signals = [each.with_covariate(effect.covariate) for each in signals]
    grid = effect.grid(signals[0].body.robot, effect.joints, signals)
    return found + [shape for shape in grid if shape != found[0]]
