"""Pull-backs of all effects against differences, through inverse dynamics and regressor."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.dynamics.spatial_adjoint import SpatialAdjoint
from excite_cli.effects.base import Cotangents, Effect, Signals
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.sign import sign_of_width
from excite_cli.excitation.gradient_check import fourth_order_differences, relative_error
from excite_cli.robot.model import Array, Robot
from tests.effects.motions import signals_at, states
from tests.robot.random_robots import random_robot

# No motion is planned for these; a model in use has their slopes all the same.
WITH_SLOPE = {"covariate_friction", "covariate_offset", "friction_change", "wrench_gain"}
EXCITABLE = [name for name, kind in catalogue().items() if kind.excitable]
SAMPLES, STEP = 5, 0.1
ROBOTS = [
    random_robot(3, joints=3, branches=False, prismatic=False),
    random_robot(8, joints=3, floating=True, rows=("joints",)),
]


# Shapes that no search tries.
DECLARED = {
    "stribeck_friction": [{"stribeck_speed": 0.4, "load_power": 1.0}],
    "dahl_friction": [{"distance": 0.05, "damping": 3.0}],
}


def _effects(kind: type[Effect], robot: Robot, signals: Signals) -> list[Effect]:
    """On the last place, with every shape; of a periodogram's many, two."""
    place = kind.places(robot)[-1]
    shapes = kind.grid(robot, place, [signals])
    if len(shapes) > 6 or not shapes:
        shapes = [kind.planted(1.0, {})[0]]
    shapes += DECLARED.get(kind.kind, [])
    return [kind(place, shape) for shape in shapes]


def _chained(robot: Robot, signals: Signals, found: Cotangents) -> Array:
    """Derivative by [q, v, a] (3, T, n) of what the cotangents belong to."""
    total = np.zeros((3, *signals.q.shape))
    for order, direct in enumerate((found.q, found.v, found.a)):
        total[order] += 0.0 if direct is None else direct
    for torque in (found.load, found.torque):
        if torque is not None:
            body = signals.body
            for order, part in enumerate((body.by_position, body.by_velocity, body.mass)):
                total[order] += np.einsum("tr,trk->tk", torque, part)
    if found.regressor is not None:
        adjoint = SpatialAdjoint(replace(robot, rows=robot.moved))
        total += np.array(adjoint.pull_back_dense(signals.q, signals.v, signals.a, found.regressor))
    return total


@pytest.mark.parametrize("name", EXCITABLE)
def test_pull_back_is_the_derivative_of_the_columns(name: str) -> None:
    for seed, robot in enumerate(ROBOTS):
        signals = signals_at(robot, *states(robot, SAMPLES, STEP, seed))
        for effect in _effects(catalogue()[name], robot, signals):
            with sign_of_width(0.5):
                found, reference = _both(robot, signals, effect)
            # Far above its speed, Stribeck friction is e^-1000: differences cannot see that.
            small = np.linalg.norm(found - reference) < 1e-9
            assert small or relative_error(found, reference) < 1e-6, (effect, seed)


def _both(robot: Robot, signals: Signals, effect: Effect) -> tuple[Array, Array]:
    """Derivative of Σ weights ∘ columns by [q, v, a], by pull-back and by differences."""
    weights = np.random.default_rng(0).normal(size=effect.columns(signals).shape)

    def value(x: Array) -> float:
        return float((weights * effect.columns(signals_at(robot, signals.t, *x))).sum())

    found = _chained(robot, signals, effect.pull_back(signals, weights))
    state = np.array([signals.q, signals.v, signals.a])
    return found, fourth_order_differences(value, state, 1e-3)


@pytest.mark.parametrize("name", sorted(set(catalogue()) - set(EXCITABLE) - WITH_SLOPE))
def test_what_cannot_be_excited_says_why(name: str) -> None:
    kind = catalogue()[name]
    assert kind.why_not_excitable
    signals = signals_at(ROBOTS[0], *states(ROBOTS[0], SAMPLES, STEP))
    effect = kind(kind.places(ROBOTS[0])[0], kind.planted(1.0, {})[0])
    with pytest.raises(NotImplementedError, match=f"{name} cannot be excited: "):
        effect.pull_back(signals, effect.columns(signals))


def test_rate_back_is_the_transpose_of_rate() -> None:
    rng = np.random.default_rng(0)
    for samples in (1, 2, 3, 4, 9):
        signals = signals_at(ROBOTS[0], *states(ROBOTS[0], samples, STEP))
        x, w = rng.normal(size=(2, samples, 3))
        forward = float((w * signals.rate(x)).sum())
        assert forward == pytest.approx(float((signals.rate_back(w) * x).sum()), abs=1e-10)
