"""Play in a gear: flights of known length, and a motor and a link with a gap between them."""

from functools import cache
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.signal import butter, sosfiltfilt

from excite_cli.effects import backlash
from excite_cli.effects.backlash import Backlash, Flights
from excite_cli.effects.base import Signals
from excite_cli.robot.model import Array, Robot
from tests.effects.motions import signals_at
from tests.robot.random_robots import random_robot

GAP = 0.008


def test_flight_lasts_as_the_gap_asks() -> None:
    """With δ'' = R t the gap is crossed after (6 b / R)^(1/3)."""
    step, rate, gap = 1e-4, 30.0, 0.01
    t = step * np.arange(-2000, 4000)
    for side in (1.0, -1.0):
        ((first, last, closed),) = Flights(side * rate * t, step).across(np.array([gap]))[0]
        assert closed
        assert (last - first) * step == pytest.approx((6 * gap / rate) ** (1 / 3), abs=3e-4)
    # Flight ends where the link comes back. With δ'' = cos t − 0.2, δ = 1 − cos t − 0.1 t² is back
    # at zero before a turn is over.
    step = 1e-3
    t = step * np.arange(9000)
    acceleration = np.concatenate([[-1e-9], np.cos(t) - 0.2])
    ((first, last, closed), *_) = Flights(acceleration, step).across(np.array([10.0]))[0]
    assert (first, closed) == (1, True)
    back = brentq(lambda x: 1 - np.cos(x) - 0.1 * x**2, 3.0, 6.0)
    assert (last - first) * step == pytest.approx(back, abs=0.01)
    # Flight that outlasts the run has no blow.
    gaps = np.array([1.0, 1e-7])
    wide, narrow = Flights(np.array([-1.0, 1.0, 1.0, 1.0]), 1e-3).across(gaps)
    assert wide == [(1, 4, False)]
    assert narrow == [(1, 2, True)]
    assert Flights(np.ones(5), 1e-3).across(gaps) == [[], []]


def test_flights_of_many_gaps_are_those_of_each_alone() -> None:
    acceleration = np.random.default_rng(2).normal(size=4000).cumsum()
    gaps = np.geomspace(1e-3, 1.0, 9)
    together = Flights(acceleration, 1e-2).across(gaps)
    for gap, found in zip(gaps, together, strict=True):
        assert found == Flights(acceleration, 1e-2).across(np.array([gap]))[0]
        assert all(last < first for (_, last, _), (first, _, _) in pairwise(found))
    assert len(together[0]) > len(together[-1])


@cache
def _robot() -> Robot:
    return random_robot(21, joints=2, branches=False, prismatic=False)


def _weight(link: float) -> float:
    model, zero = _robot().model, np.zeros(2)
    return float(pin.rnea(model, model.createData(), np.array([0.0, link]), zero, zero)[1])


@cache
def _with_play(gap: float) -> tuple[Signals, Array]:
    """Filtered signals of the last joint's motor, and its gear's torque that bodies leave over."""
    robot, zero = _robot(), np.zeros(2)
    inertia = pin.crba(robot.model, robot.model.createData(), zero)[1, 1]
    stiffness, damping, rotor = 4e4 * inertia, 40 * inertia, 0.5 * inertia
    turn = np.linspace(-4, 4, 200)
    weights = np.array([_weight(link) for link in turn])
    rest = turn[np.flatnonzero((weights[:-1] < 0) & (weights[1:] >= 0))[0]]

    def gear(x: Array) -> float:
        angle = x[0] - x[1]
        pressed = np.sign(angle) * max(abs(angle) - gap / 2, 0.0)
        force = stiffness * pressed + damping * (x[2] - x[3])
        return float(force) if force * pressed > 0 else 0.0

    def rates(t: float, x: Array) -> Array:
        wanted = rest + 1.2 * np.sin(2 * t) + 0.3 * np.sin(3.3 * t)
        speed = 2.4 * np.cos(2 * t) + 0.99 * np.cos(3.3 * t)
        drive = inertia * (900 * (wanted - x[0]) + 90 * (speed - x[2]))
        torque = gear(x)
        return np.array([x[2], x[3], (drive - torque) / rotor, (torque - _weight(x[1])) / inertia])

    t = np.arange(0.0, 5.0, 0.002)
    start = np.array([rest, rest, 0.0, 0.0])
    path = solve_ivp(rates, (0, 5), start, t_eval=t, rtol=1e-6, atol=1e-8, max_step=1e-3).y
    kept = t > 1.0
    sos = butter(4, 20, fs=500, output="sos")
    slopes = np.array([rates(at, x) for at, x in zip(t[kept], path.T[kept], strict=True)])
    motor = sosfiltfilt(sos, np.stack([path[0, kept], path[2, kept], slopes[:, 2]]))
    q, v, a = np.stack([np.zeros_like(motor), motor], axis=-1)
    signals = signals_at(robot, t[kept] - 1.0, q, v, a)
    torque = sosfiltfilt(sos, [gear(x) for x in path.T[kept]])
    return signals, torque - signals.load[:, 1]


def test_flights_and_blows_are_those_of_two_bodies_with_play() -> None:
    signals, residual = _with_play(GAP)
    sos = butter(4, 20, fs=500, output="sos")
    column = sosfiltfilt(sos, Backlash((1,), {"gap": GAP}).columns(signals)[:, 1, 0])
    inner = slice(100, -100)
    share = float(column[inner] @ residual[inner] / (column[inner] @ column[inner]))
    assert 0.9 < share < 1.2
    left = np.linalg.norm((residual - share * column)[inner]) / np.linalg.norm(residual[inner])
    assert left < 0.25


def test_gap_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the middles of long recordings."""
    signals, residual = _with_play(GAP)
    both = np.stack([np.zeros_like(residual), residual], axis=-1)
    (shape,) = Backlash.tuned(_robot(), (1,), [signals], [both])
    assert shape["gap"] == pytest.approx(GAP, rel=0.1)
    early = np.arange(len(both)) < len(both) // 4
    both[early] = both[~early][: early.sum()]  # what has nothing to do with the motion there
    monkeypatch.setattr(backlash, "_SEARCHED", len(both))
    (shape,) = Backlash.tuned(_robot(), (1,), [signals, signals], [both, both])
    assert shape["gap"] == pytest.approx(GAP, rel=0.1)
