"""Torques that nobody measured: by the law of a drive, or the voltage of a motor."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import ConfigError, FileError
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.torque import check_joints, to_joints
from excite_cli.measurement.torque_sources.catalogue import TORQUE_SOURCES, torque_source
from excite_cli.measurement.torque_sources.command import DriveLaw, held, hold_std, law_of
from tests.measurement.recordings import JOINTS, check, motion, only, read, recorded

TURNS = np.ones(3, bool)


def sent(ahead: float = 0.1, **extra: Any) -> Run:
    """A run whose set points lead its positions by so many seconds."""
    run = recorded()
    return replace(run, extra={"q_cmd": motion(run.t + ahead)[0], **extra})


def by_law(run: Run, **command: Any) -> Run:
    spec = MeasurementSpec(torque="command", command={"period": 0.0, **command})
    return to_joints(run, spec, JOINTS, TURNS)


def test_the_law_of_a_drive() -> None:
    run = sent()
    kp, kd = {"shoulder": 20.0, "elbow": 30.0, "wrist": 5.0}, 1.5
    tau = by_law(run, kp=kp, kd=kd, delay=0.0).tau
    half = motion(run.t + 0.1 - 0.5 * run.step)[0]  # a set point stands for a whole sample
    assert run.dq is not None
    law = np.array([20.0, 30.0, 5.0]) * (half - run.q) - kd * run.dq
    assert np.abs(tau - law)[2:].max() < 5e-3
    limited = by_law(run, kp=kp, kd=kd, delay=0.0, limit=1.0).tau
    np.testing.assert_array_equal(limited, np.clip(tau, -1.0, 1.0))
    feed = np.full_like(run.q, 0.25)
    both = replace(run, extra={**run.extra, "v_cmd": motion(run.t)[1], "tau_ff": feed})
    np.testing.assert_allclose(
        by_law(both, kp=kp, kd=kd, delay=0.0).tau[2:],
        (tau + kd * motion(run.t - 0.5 * run.step)[1] + feed)[2:], atol=5e-3,
    )  # fmt: skip


def test_set_points_act_later_and_stand_until_the_next() -> None:
    run = sent()
    late = held(run, 0.02)["q_cmd"]
    then = motion(run.t + 0.1 - 0.02 - 0.5 * run.step)[0]
    assert np.abs(late - then)[10:].max() < 1e-4
    assert np.abs(held(run, 0.0)["q_cmd"] - then)[10:].max() > 0.01


def test_the_drive_answers_half_of_its_period_later() -> None:
    run = sent()
    tau = by_law(run, kp=20.0, kd=1.5, delay=0.0, period=0.02).tau
    before = motion(run.t - 0.01)
    half = motion(run.t + 0.1 - 0.5 * run.step)[0]
    assert run.dq is not None
    law = 20.0 * (half - before[0]) - 1.5 * before[1]
    assert np.abs(tau - law)[10:].max() < 0.1  # noise of the recorded speeds


def test_set_points_have_the_units_of_positions() -> None:
    run = sent()
    degrees = replace(
        run, q=np.degrees(run.q), dq=None, extra={"q_cmd": np.degrees(run.extra["q_cmd"])}
    )
    spec = MeasurementSpec(
        torque="command", command={"kp": 20.0, "period": 0.0}, angle="deg",
        position_sign={"elbow": -1}, offset={"wrist": 0.2},
    )  # fmt: skip
    found = to_joints(degrees, spec, JOINTS, TURNS)
    plain = by_law(replace(run, dq=None), kp=20.0).tau
    np.testing.assert_allclose(found.tau, plain * [1.0, -1.0, 1.0], atol=1e-9)


def test_what_the_config_leaves_open() -> None:
    law = law_of(MeasurementSpec(torque="command"), JOINTS)
    assert law.kp.tolist() == [1.0, 1.0, 1.0]
    assert (law.delay, law.kd.tolist()) == (0.0, [0.0, 0.0, 0.0])
    assert np.isinf(law.limit).all()


def test_the_voltage_of_a_motor() -> None:
    run = recorded()
    volts = np.sin(run.q)
    run = replace(run, extra={"voltage": volts, "duty": volts / 12.0, "vbat": 12.0 + 0.0 * run.t})
    motor = {"resistance": 2.0, "back_emf": {"shoulder": 0.02, "elbow": 0.03, "wrist": 0.04}}
    told = {"torque_constant": 0.05, "gear_ratio": 200.0, "motor": motor}
    found = to_joints(run, MeasurementSpec(torque="voltage", **told), JOINTS, TURNS)
    assert run.dq is not None
    back = np.array([0.02, 0.03, 0.04]) * 200.0 * run.dq
    np.testing.assert_allclose(found.tau, 200.0 * 0.05 * (volts - back) / 2.0)
    for supply in ("vbat", 12.0):
        spec = MeasurementSpec(torque="duty", **{**told, "motor": {**motor, "supply": supply}})
        np.testing.assert_allclose(to_joints(run, spec, JOINTS, TURNS).tau, found.tau)
    alike = MeasurementSpec(torque="voltage", torque_constant=0.05)  # k_e is k_t
    np.testing.assert_allclose(
        to_joints(run, alike, JOINTS, TURNS).tau, 0.05 * (volts - 0.05 * run.dq)
    )
    spec = MeasurementSpec(torque="duty", motor={"supply": "vbatt"})
    with pytest.raises(ConfigError, match=r"no column 'vbatt'. Did you mean 'vbat'\?"):
        to_joints(run, spec, JOINTS, TURNS)


def table(path: Path, run: Run, *channels: str) -> Path:
    """A CSV file of t, q and some channels."""
    columns = {"t": run.t}
    columns |= {f"q_{joint}": run.q[:, j] for j, joint in enumerate(JOINTS)}
    for channel in channels:
        values = run.tau if channel == "tau" else run.extra[channel]
        columns |= {f"{channel}_{joint}": values[:, j] for j, joint in enumerate(JOINTS)}
    np.savetxt(path, np.column_stack(list(columns.values())), "%.9g", ",",
               header=",".join(columns), comments="")  # fmt: skip
    return path


def test_columns_of_a_file(tmp_path: Path) -> None:
    run = sent()
    told = {"torque": "command", "command": {"kp": 20.0, "delay": 0.0, "period": 0.0}}
    (found,) = read(table(tmp_path / "a.csv", run, "q_cmd"), **told).runs
    law = by_law(replace(run, dq=None), kp=20.0, delay=0.0).tau
    np.testing.assert_allclose(found.tau, law, atol=1e-5)
    (other,) = read(table(tmp_path / "b.csv", run, "q_cmd", "tau"), **told).runs
    np.testing.assert_allclose(other.tau, law, atol=1e-5)  # what was recorded beside does not count
    (without,) = read(tmp_path / "a.csv", without_torque=("elbow",), **told).runs
    assert not without.tau[:, 1].any()
    assert not without.usable()[:, 1].any()


def test_torques_of_a_gain_that_is_sought_are_not_judged_by_size() -> None:
    run = sent(ahead=0.001)
    small = replace(run, tau=by_law(run, kp=1.0, delay=0.0).tau)
    assert not check(small, torque="command")[1]
    assert only(check(small, torque="command", command={"kp": 1.0})[1], "torque_units")


def test_without_set_points_or_source(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", recorded(), "tau")
    with pytest.raises(FileError, match="no columns 'q_cmd_<joint>'"):
        read(path, torque="command")
    with pytest.raises(ConfigError, match="no source of torque 'comand'"):
        read(path, torque="comand")


@pytest.mark.parametrize("name", TORQUE_SOURCES.own)
def test_every_source_says_what_it_needs(name: str) -> None:
    source = torque_source(MeasurementSpec(torque=name))
    assert source.name == name
    assert source.channels
    assert source.title
    assert bool(source.scaled_by) == (name != "link")


def test_gains_of_all_joints_or_none() -> None:
    with pytest.raises(ConfigError, match=r"measurement.command.kp: no value for elbow, wrist"):
        check_joints(MeasurementSpec(torque="command", command={"kp": {"shoulder": 2.0}}), JOINTS)
    with pytest.raises(ConfigError, match=r"measurement.command.kd: 'elbo' is not a moved joint"):
        check_joints(MeasurementSpec(torque="command", command={"kd": {"elbo": 2.0}}), JOINTS)


def test_what_gains_are_unsure_of_scales_the_torques_of_driven_joints() -> None:
    """Of a base of one row before two drives, whose gains have errors in common."""
    half = np.array([[0.1, 0.0], [0.1, 0.2]])
    law = DriveLaw(np.ones(2), np.zeros(2), np.full(2, np.inf), 0.0, gain_half=half)
    changes = law.by_gains(np.array([[7.0, 1.0, -2.0]]))
    assert changes == pytest.approx(np.array([[[0.0, 0.1, -0.2]], [[0.0, 0.0, -0.4]]]))
    assert len(replace(law, gain_half=None).by_gains(np.ones((1, 3)))) == 0


def test_when_a_set_point_came_between_samples_is_uncertain_by_half_a_step() -> None:
    t = np.arange(100) * 0.02
    run = Run("r", t, np.zeros((100, 1)), np.zeros((100, 1)), extra={"q_cmd": t[:, None]})
    law = DriveLaw(np.array([50.0]), np.zeros(1), np.full(1, np.inf), 0.0, lag=5e-4)
    by_delay, by_loop = law.unsure(run)
    assert hold_std(run) == pytest.approx(0.01 / np.sqrt(12.0))  # uniform on 10 ms
    assert by_delay[50, 0] == pytest.approx(-50.0 * hold_std(run))
    assert by_loop[50, 0] == pytest.approx(0.0)  # it stands still
