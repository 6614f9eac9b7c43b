"""Every fault is named, with what to do; the clean recording gives no finding."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.measurement.quality import mask_saturated, raise_for_errors, sentence
from excite_cli.measurement.speed_lag import speed_lag
from tests.measurement.recordings import JOINTS, check, only, recorded, without_speed


def with_tau(run: Run, column: int, values: np.ndarray | float, rows: slice = slice(None)) -> Run:
    tau = run.tau.copy()
    tau[rows, column] = values
    return replace(run, tau=tau)


def with_q(run: Run, q: np.ndarray) -> Run:
    return replace(run, q=q)


def error(findings: list[Finding], kind: str, *parts: str) -> None:
    found = only(findings, kind)
    assert found.severity == "error"
    for part in parts:
        assert part in found.text


@pytest.mark.parametrize("rate", [50.0, 125.0, 1000.0])
@pytest.mark.parametrize("seed", range(3))
def test_no_false_alarm(rate: float, seed: int) -> None:
    run = recorded(rate=rate, seed=seed)
    for clean in (run, without_speed(run)):
        runs, findings = check(clean)
        assert findings == []
        assert runs[0].valid is None


def test_no_false_alarm_on_coarse_sensors() -> None:
    run = recorded(rate=1000.0)
    smooth = 12 * np.cos(run.q)
    for tau in (run.tau, smooth):
        coarse = replace(run, q=np.round(run.q / 5e-4) * 5e-4, tau=np.round(tau / 0.3) * 0.3)
        runs, findings = check(coarse)
        assert {found.kind for found in findings} <= {"torque_steps"}  # of the shoulder, rightly
        assert runs[0].valid is None


def test_no_false_alarm_at_rest_without_noise() -> None:
    run = recorded()
    start = np.arange(400) / 200
    rest = Run(
        "run",
        np.concatenate([start, run.t + 2]),
        np.vstack([np.tile(run.q[0], (400, 1)), run.q]),
        np.vstack([np.tile(run.tau[0], (400, 1)), run.tau]),
    )
    assert check(rest)[1] == []


# --- units


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_time_in_another_unit(unit: str, factor: float) -> None:
    run = recorded()
    for spoiled in (run, without_speed(run)):
        _, findings = check(replace(spoiled, t=spoiled.t * factor))
        error(findings, "units", f"Write measurement.time: {unit}")


def test_seconds_declared_as_milliseconds() -> None:
    run = recorded()
    for spoiled in (run, without_speed(run)):
        _, findings = check(replace(spoiled, t=spoiled.t * 1e-3), time="ms")
        error([f for f in findings if f.kind == "units"], "units", "Write measurement.time: s")


def test_degrees() -> None:
    run = recorded()
    assert run.dq is not None
    degrees = np.degrees(run.q)
    error(check(without_speed(with_q(run, degrees)))[1], "units", "Write measurement.angle: deg")
    both = replace(run, q=degrees, dq=np.degrees(run.dq))
    error(check(both)[1], "units", "Write measurement.angle: deg")
    error(check(with_q(run, degrees))[1], "units", "speeds in rad/s", "measurement.angle: deg",
          "{dq: null}")  # fmt: skip
    error(check(replace(run, dq=np.degrees(run.dq)))[1], "units", "degrees per second",
          "{dq: null}")  # fmt: skip
    error(check(replace(run, dq=run.dq * 30 / np.pi))[1], "units", "turns per minute")


def test_radians_declared_as_degrees() -> None:
    run = without_speed(recorded())
    found = only(check(with_q(run, np.radians(run.q)), angle="deg")[1], "units")
    assert "measurement.angle: rad" in found.text


def test_odd_gain_offset_and_torque() -> None:
    run = recorded()
    assert run.dq is not None
    found = only(check(replace(run, dq=run.dq * [1, 1.6, 1]))[1], "gain")
    assert "elbow is 1.6 times" in found.text
    found = only(check(with_q(run, run.q + np.array([0, 3.5, 0])))[1], "outside_limits")
    assert "measurement.offset" in found.text
    found = only(check(replace(run, tau=run.tau * 100))[1], "torque_units")
    assert found.severity == "note"
    found = only(check(replace(run, tau=run.tau / 100))[1], "torque_units")
    assert "measurement.torque: motor" in found.text


# --- channels


def test_dead_torque() -> None:
    error(check(with_tau(recorded(), 1, 0.0))[1], "dead_torque", "torque of elbow is constant at 0")
    error(check(with_tau(recorded(), 1, np.nan))[1], "dead_torque", "torque of elbow is NaN")


def test_dead_position() -> None:
    run = recorded()
    q = run.q.copy()
    q[:, 2] = 0.25
    error(check(with_q(run, q))[1], "dead", "wrist is constant at 0.25", "encoder")
    error(check(without_speed(with_q(run, q)))[1], "dead", "robot.joints", "{wrist: 0.25}")
    _, findings = check(with_q(run, np.tile(run.q[0], (len(run.t), 1))))
    assert {found.severity for found in findings if found.kind == "dead"} == {"error"}


def test_a_joint_held_in_one_run_is_masked_there() -> None:
    first, second = without_speed(recorded(name="a")), without_speed(recorded(name="b", seed=1))
    q = second.q.copy()
    q[:, 2] = 0.25
    runs, findings = check(first, with_tau(with_q(second, q), 2, 0.0))
    assert only(findings, "held").severity == "warning"
    assert runs[0].valid is None
    assert runs[1].usable().all(axis=0).tolist() == [True, True, False]


def test_dead_speed_is_not_used() -> None:
    run = recorded()
    assert run.dq is not None
    (back,), findings = check(replace(run, dq=run.dq * [1, 0, 1]))
    assert "elbow is constant" in only(findings, "dead_speed").text
    assert back.dq is None


def test_a_column_written_twice() -> None:
    run = recorded()
    error(check(with_tau(run, 2, run.tau[:, 0]))[1], "duplicate", "shoulder and wrist")


def test_swapped_and_turned_speeds() -> None:
    run = recorded()
    assert run.dq is not None
    _, findings = check(replace(run, dq=run.dq[:, [1, 0, 2]]))
    error(findings, "swapped", "the speed of shoulder follows elbow", "{dq: null}")
    assert findings[0].joints == ("shoulder", "elbow")
    _, findings = check(replace(run, dq=run.dq * [1, 1, -1]))
    error(findings, "sign", "position_sign: {wrist: -1}", "velocity_sign: {wrist: -1}")


@pytest.mark.parametrize("steps", [-8, 0, 5])
def test_late_speeds(steps: int) -> None:
    run = recorded()
    assert run.dq is not None
    late = replace(run, dq=np.roll(run.dq, steps, axis=0)).cut(20, 1500)
    assert speed_lag(late) == pytest.approx(steps / 200, abs=1e-3)
    assert [found.kind for found in check(late)[1]] == (["lag"] if steps else [])


@pytest.mark.parametrize("lag", [0.0117, -0.0121, 0.0963])
def test_a_lag_is_known_to_a_part_of_a_sample(lag: float) -> None:
    """Also near the longest that is looked for, 0.1 s."""
    t = np.arange(2000) / 200
    rates = np.array([1.1, 2.3, 3.7])
    q, dq = np.sin(rates * t[:, None]), rates * np.cos(rates * (t[:, None] - lag))
    late = Run("late", t, q, np.zeros_like(q), dq=dq)
    assert speed_lag(late) == pytest.approx(lag, abs=0.05 / 200)


# --- samples


@pytest.mark.parametrize("step", [0.0, 0.02])
def test_saturated_torque(step: float) -> None:
    run = recorded()
    tau = np.round(run.tau / step) * step if step else run.tau
    level = 0.8 * float(tau[:, 0].max())
    spoiled = with_tau(run, slice(None), tau)  # type: ignore[arg-type]
    spoiled = with_tau(spoiled, 0, np.minimum(tau[:, 0], level))
    (back,), findings = check(spoiled)
    found = only(findings, "saturated")
    share = np.mean(tau[:, 0] >= level)
    assert found.joints == ("shoulder",)
    assert f"upper limit {level:.6g} N·m in {share:.1%}" in found.text
    np.testing.assert_array_equal(back.usable()[:, 0], tau[:, 0] < level)
    assert back.usable()[:, 1:].all()
    _, findings = mask_saturated(spoiled, JOINTS, np.zeros(len(JOINTS), dtype=bool))
    assert f"upper limit {level:.6g} N in {share:.1%}" in only(findings, "saturated").text


def test_a_coarse_torque_at_rest_is_not_saturated() -> None:
    run = without_speed(recorded(rate=1000.0))
    q, tau = run.q.copy(), np.round(run.tau / 0.1) * 0.1
    q[:600], tau[:600, 0] = q[600], tau[:, 0].max() + 1
    (back,), findings = check(replace(run, q=q, tau=tau))
    assert findings == []
    assert back.valid is None


def test_stale_messages_are_masked() -> None:
    run = without_speed(recorded())
    q, tau = run.q.copy(), run.tau.copy()
    q[300:304], tau[300:304] = q[299], tau[299]
    q[900], tau[900] = q[899], tau[899]
    (back,), findings = check(replace(run, q=q, tau=tau))
    assert "5 of 1600 samples" in only(findings, "stale").text
    assert np.flatnonzero(~back.usable()[:, 0]).tolist() == [300, 301, 302, 303, 900]


def test_a_torque_that_stands_for_a_while() -> None:
    run = recorded()
    (back,), findings = check(with_tau(run, 1, run.tau[599, 1], slice(600, 700)))
    assert "torque of elbow stands" in only(findings, "stuck").text
    assert not back.usable()[600:700, 1].any()
    assert back.usable()[:, [0, 2]].all()


def test_missing_torque_is_masked_for_its_joint() -> None:
    (back,), findings = check(with_tau(recorded(), 1, np.inf, slice(100, 130)))
    assert "30 of 1600" in only(findings, "nan_torque").text
    assert np.flatnonzero(~back.usable()[:, 1]).tolist() == list(range(100, 130))
    assert back.usable()[:, [0, 2]].all()
    assert np.isfinite(back.tau).all()


def test_missing_positions_are_bridged_or_split() -> None:
    run = recorded()
    q = run.q.copy()
    q[500:502, 0] = np.nan
    (back,), findings = check(with_q(run, q))
    assert [found.kind for found in findings] == ["nan_position", "bridged"]
    np.testing.assert_allclose(back.q, run.q, atol=1e-5)
    assert np.flatnonzero(~back.usable().any(axis=1)).tolist() == [500, 501]
    q[800:900, 2] = np.nan
    parts, findings = check(with_q(run, q))
    assert "gap" in [found.kind for found in findings]
    assert [part.label for part in parts] == ["run/1", "run/2"]


def test_missing_speed_and_stamps() -> None:
    run = recorded()
    assert run.dq is not None
    dq, t = run.dq.copy(), run.t.copy()
    dq[7, 1] = np.nan
    assert only(check(replace(run, dq=dq))[1], "nan_speed").severity == "note"
    dq[:, 1] = np.nan
    (back,), findings = check(replace(run, dq=dq))
    only(findings, "nan_speed")
    assert back.dq is None
    t[40] = np.nan
    assert [found.kind for found in check(replace(run, t=t))[1]] == ["nan", "bridged"]
    with pytest.raises(FileError, match="nothing is left"):
        check(with_q(run, np.full_like(run.q, np.nan)))


# --- together


def test_errors_are_raised_together(tmp_path: Path) -> None:
    runs, findings = check(with_tau(recorded(), 1, 0.0), time="s")
    data = Dataset(JOINTS, tuple(runs), ("a.csv",), tuple(findings))
    findings.append(Finding("sign", "error", "another fault", "b"))
    with pytest.raises(FileError) as caught:
        raise_for_errors(replace(data, findings=tuple(findings)))
    lines = str(caught.value).splitlines()
    assert lines[0] == "a.csv: these data cannot be used:"
    assert lines[1].startswith("- run: torque of elbow is constant at 0")
    assert lines[2] == "- b: another fault."
    warning = Finding("gap", "warning", "a gap")
    assert sentence(warning) == "a gap."
    raise_for_errors(replace(data, findings=(warning,)))


def test_stamps_in_another_unit_are_not_lost_as_missing() -> None:
    """Nanoseconds declared as seconds pass 1e12 after 17 minutes: refused, not cut."""
    run = recorded()
    with pytest.raises(FileError, match=r"1\.599e\+12 s: no clock gives .* measurement\.time"):
        check(replace(run, t=np.round(run.t * 2e11)))
    t = run.t.copy()
    t[7] = np.finfo(np.float32).max  # as recorders write where they have none
    _, findings = check(replace(run, t=t))
    assert "1 rows without a time stamp" in findings[0].text


@pytest.mark.parametrize("rate", [500.0, 1000.0])
def test_stale_messages_are_filled_and_masked_be_they_slow_or_close(rate: float) -> None:
    """One to three repeats of all channels, 3 % of the samples, at any speed of the robot."""
    run = recorded(rate=rate)
    rng = np.random.default_rng(1)
    first = np.flatnonzero(rng.uniform(size=len(run.t)) < 0.015)
    stale = np.zeros(len(run.t), bool)
    for at, length in zip(first, rng.integers(1, 4, len(first)), strict=True):
        stale[at + 1 : at + 1 + length] = True
    held = np.maximum.accumulate(np.where(stale, 0, np.arange(len(run.t))))
    runs, findings = check(replace(run, q=run.q[held], tau=run.tau[held], dq=None))
    assert only(findings, "stale").severity == "warning"
    assert np.array_equal(runs[0].usable(), np.tile(~stale[:, None], run.tau.shape[1]))
    step = np.abs(np.diff(run.q, axis=0)).max()
    assert np.abs(runs[0].q - run.q).max() < 0.5 * step


def test_torques_too_small_for_a_square_are_none() -> None:
    run = recorded()
    found = check(replace(run, tau=run.tau * 1e-200))[1]
    assert {(each.kind, each.severity) for each in found} == {("dead_torque", "error")}
    assert all("those of all joints are constant (at 0" in each.text for each in found)
