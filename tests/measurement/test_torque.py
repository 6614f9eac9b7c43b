"""From recorded units to joints, against plain arithmetic and against each other."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import ConfigError
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.torque import check_joints, declared, in_step, to_joints
from tests.measurement.recordings import JOINTS, recorded

TURNS = np.array([True, True, False])


def converted(run: Run, **spec: Any) -> Run:
    check_joints(MeasurementSpec(**spec), JOINTS)
    return to_joints(run, MeasurementSpec(**spec), JOINTS, TURNS)


def test_torque_as_recorded_of_motors_and_from_currents() -> None:
    run = recorded()
    for name in ("t", "q", "dq", "tau"):
        np.testing.assert_array_equal(getattr(converted(run), name), getattr(run, name))
    ratio = {"shoulder": 100.0, "elbow": -50.0, "wrist": 30.0}
    back = converted(run, torque="current", gear_ratio=ratio, torque_constant=0.2,
                     sign={"wrist": -1})  # fmt: skip
    np.testing.assert_allclose(back.tau, run.tau * [20.0, -10.0, -6.0])
    motor = converted(run, torque="motor", gear_ratio=ratio)
    np.testing.assert_allclose(motor.tau, run.tau * [100.0, -50.0, 30.0])


def test_degrees_only_for_joints_that_turn() -> None:
    run = recorded()
    back = converted(run, angle="deg", position_sign={"elbow": -1}, velocity_sign={"shoulder": -1},
                     offset={"shoulder": 0.5})  # fmt: skip
    radians = np.pi / 180
    np.testing.assert_allclose(back.q, run.q * [radians, -radians, 1.0] + [0.5, 0, 0])
    assert back.dq is not None
    assert run.dq is not None
    np.testing.assert_allclose(back.dq, run.dq * [-radians, radians, 1.0])


def test_coupled_transmission_keeps_power() -> None:
    """Motor torques times motor speeds is joint torques times joint speeds."""
    run = recorded()
    back = converted(run, torque="motor", position="motor",
                     gear_ratio={"shoulder": 45.0, "elbow": -48.0, "wrist": 32.0},
                     coupling={"shoulder": {"wrist": 1.0}, "elbow": {"wrist": 0.3}})  # fmt: skip
    assert back.dq is not None
    assert run.dq is not None
    at_motors, at_joints = (run.tau * run.dq).sum(axis=1), (back.tau * back.dq).sum(axis=1)
    np.testing.assert_allclose(at_joints, at_motors, rtol=1e-9)
    np.testing.assert_allclose(back.tau[:, 0], 45 * run.tau[:, 0] + 32 * run.tau[:, 2])


def test_missing_values_stay_with_their_joint() -> None:
    run = recorded()
    tau = run.tau.copy()
    tau[5, 0] = np.nan
    back = converted(replace(run, tau=tau), coupling={"elbow": {"wrist": 1.0}})
    assert np.isnan(back.tau).sum() == 1


@pytest.mark.parametrize(
    ("spec", "parts"),
    [
        ({"gear_ratio": {"shoulder": 1.0}}, ("measurement.gear_ratio", "elbow, wrist")),
        ({"sign": {"elbo": -1}}, ("measurement.sign", "Did you mean 'elbow'", "Moved joints")),
        ({"offset": {"tip": 1.0}}, ("measurement.offset", "'tip'")),
        ({"coupling": {"elbow": {"x": 1.0}}}, ("measurement.coupling", "'x'")),
        ({"coupling": {"elbow": {"elbow": -1.0}}}, ("cannot be inverted",)),
        ({"gear_ratio": 0.0}, ("ratio of 0",)),
        ({"without_torque": ["elbo"]}, ("measurement.without_torque", "Did you mean 'elbow'")),
        ({"without_torque": JOINTS}, ("names every joint",)),
        (
            {"without_torque": ["wrist"], "coupling": {"elbow": {"wrist": 1.0}}},
            ("torque of elbow is that of wrist", "Name elbow there, too"),
        ),
    ],
)
def test_declarations_that_do_not_fit(spec: dict[str, Any], parts: tuple[str, ...]) -> None:
    with pytest.raises(ConfigError) as caught:
        check_joints(MeasurementSpec(**spec), JOINTS)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("spec", "text"),
    [
        ({"torque": "motor"}, "every gear_ratio is 1"),
        ({"gear_ratio": 50.0}, "not applied"),
        ({"torque_constant": 0.2}, "not applied"),
        ({}, ""),
        ({"torque": "motor", "gear_ratio": 50.0}, ""),
    ],
)
def test_declarations_that_contradict_themselves(spec: dict[str, Any], text: str) -> None:
    told = declared(MeasurementSpec(**spec), JOINTS)
    assert [text in found.text for found in told] == [True] * bool(text)


@pytest.mark.parametrize("begin", [0.0, 5.0])
def test_what_is_masked_moves_with_its_torque(begin: float) -> None:
    run = recorded()
    valid = np.ones(run.tau.shape, bool)
    valid[100, 1] = False
    back = in_step(replace(run, t=run.t + begin, valid=valid), 0.1)
    assert np.argwhere(~back.usable()).tolist() == [[80, 1]]
    np.testing.assert_allclose(back.tau[:-20], run.tau[20:], atol=1e-9)
