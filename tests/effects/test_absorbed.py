"""What docs/effects.md says a declared model of rigid bodies and friction absorbs, on a UR10."""

from functools import cache

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.effects.base import Signals
from excite_cli.effects.catalogue import catalogue
from excite_cli.robot.model import Array, Robot, build_robot
from tests.effects.motions import signals_at

JOINTS = 6


@cache
def _ur10() -> tuple[Robot, Signals, Array]:
    """The robot, five harmonics over 15 s, and an orthonormal basis of the declared model."""
    robot = build_robot(RobotSpec(urdf="example-robot-data:ur10"))
    t = 0.03 * np.arange(500)
    rng = np.random.default_rng(1)
    rates = 2 * np.pi * 0.1 * np.arange(1, 6)
    waves = np.exp(1j * t[:, None] * rates)
    sizes = (rng.normal(size=(5, JOINTS)) + 1j * rng.normal(size=(5, JOINTS))) / rates[:, None]
    sizes /= np.abs((waves @ sizes).real).max(axis=0) / 1.3
    q, v, a = ((waves * (1j * rates) ** order @ sizes).real for order in range(3))
    signals = signals_at(robot, t, q, v, a)
    model = signals.body.regressor.reshape(len(t) * JOINTS, -1)
    for kind in ("viscous_friction", "coulomb_friction"):
        for j in range(JOINTS):
            model = np.hstack([model, _column(signals, kind, (j,))])
    model /= np.maximum(np.linalg.norm(model, axis=0), 1e-9)
    basis, sizes_of, _ = np.linalg.svd(model, full_matrices=False)
    return robot, signals, basis[:, sizes_of > 1e-9 * sizes_of[0]]


def _column(signals: Signals, kind: str, joints: tuple[int, ...]) -> Array:
    effect = catalogue()[kind](joints)
    columns = np.zeros((*signals.q.shape, len(effect.parameters)))
    columns[:, list(effect.rows(JOINTS))] = effect.columns(signals)
    return columns.reshape(signals.q.size, -1)


def _left(kind: str, joints: tuple[int, ...]) -> float:
    """Largest share of a column that the declared model cannot take."""
    _, signals, basis = _ur10()
    columns = _column(signals, kind, joints)
    left = np.linalg.norm(columns - basis @ (basis.T @ columns), axis=0)
    return float((left / np.maximum(np.linalg.norm(columns, axis=0), 1e-12)).max())


@pytest.mark.parametrize(
    ("kind", "absorbed", "visible"),
    [
        ("armature", (0, 1), (2, 3, 4, 5)),
        ("encoder_offset", (0, 5), (4,)),
        ("torque_offset", (), (0, 2, 3, 4, 5)),
        ("load_dependent_friction", (), range(JOINTS)),
        ("elasticity", (), range(JOINTS)),
    ],
)
def test_effects_of_single_joints(
    kind: str, absorbed: tuple[int, ...], visible: tuple[int, ...]
) -> None:
    assert all(_left(kind, (j,)) < 1e-6 for j in absorbed)
    assert all(_left(kind, (j,)) > 0.2 for j in visible)


def test_causes_seen_on_all_joints() -> None:
    every = tuple(range(JOINTS))
    assert _left("payload", every) < 1e-6
    assert _left("base_tilt", every) > 0.3
    assert _left("torque_delay", every) > 0.3
