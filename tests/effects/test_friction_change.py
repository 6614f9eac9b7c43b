"""Friction over a campaign: where a recording stands on the clock, and what its numbers mean."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.effects.friction_change import FrictionChange
from excite_cli.effects.signals import Signals
from excite_cli.measurement.run_identity import RunId
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

CHANGE = np.array([-0.9, 0.4])
ROBOT = random_robot(9, joints=3, branches=False)


def at(signals: Signals, start: float, name: str = "run") -> Signals:
    return replace(signals, start=start, run=RunId(name))


@pytest.mark.parametrize("constant", [1.0, 30.0, 1e4])
def test_nothing_at_the_start_and_all_of_it_at_the_end(constant: float) -> None:
    signals = signals_of(ROBOT, 200)
    effect = FrictionChange((1,), {"time_constant": constant, "span": 100.0})
    v = signals.v[:, 1]
    first = effect.torque(at(signals, 0.0), CHANGE)[:, 1]
    last = effect.torque(at(signals, 100.0), CHANGE)[:, 1]
    assert not first.any()
    assert last == pytest.approx(-0.9 * np.sign(v) + 0.4 * v, rel=1e-6)


def test_a_long_time_constant_is_a_straight_line_a_short_one_is_soon_over() -> None:
    clock = np.array([0.0, 25.0, 50.0])
    line = FrictionChange((0,), {"time_constant": 2000.0, "span": 100.0})
    assert [line.progress(t) for t in clock] == pytest.approx(clock / 100.0, abs=0.015)
    quick = FrictionChange((0,), {"time_constant": 5.0, "span": 100.0})
    assert quick.progress(25.0) > 0.99


def test_it_is_looked_for_over_the_span_of_three_recordings_or_more() -> None:
    signals = signals_of(ROBOT, 50)
    runs = [at(signals, 60.0 * k, f"r{k}") for k in range(3)]
    span = 120.0
    grid = FrictionChange.grid(ROBOT, (0,), runs)
    assert [shape["span"] for shape in grid] == pytest.approx([span] * len(grid))
    assert FrictionChange.grid(ROBOT, (0,), runs[:2]) == []
    assert FrictionChange.grid(ROBOT, (0,), [runs[0]] * 3) == []
    effect = FrictionChange((0,), {"time_constant": 10.0, "span": 100.0})
    assert not effect.finer_steps("span", [])
    assert effect.finer_steps("time_constant", [])
    # What is over before the second recording is a step and not looked for.
    runs = [at(signals, start, f"r{start}") for start in (0.0, 60.0, 120.0)]
    grid = FrictionChange.grid(ROBOT, (0,), runs)
    assert grid
    for shape in grid:
        found = FrictionChange((0,), shape)
        assert found.progress(60.0) < 0.9
        for step in found.finer_steps("time_constant", runs):
            constant = shape["time_constant"] - step
            assert FrictionChange((0,), {**shape, "time_constant": constant}).progress(60.0) < 0.9
