"""Every fault is named, with what to do; the clean recording gives no finding."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array, Dataset, Finding, Run, joined, merged
from excite_cli.measurement.missing_values import without_missing
from excite_cli.measurement.quality import mask_saturated, raise_for_errors, sentence, unwrapped
from excite_cli.measurement.recording_limits import RecordingLimits
from excite_cli.measurement.resolution import lattice_step
from excite_cli.measurement.speed_lag import speed_lag
from excite_cli.measurement.torque import angle_units
from excite_cli.measurement.units import check_units
from tests.measurement.recordings import JOINTS, LIMITS, check, only, recorded, without_speed

Change = Callable[[Run], Run]
DEGREES = 180 / np.pi


def with_column(run: Run, channel: str, column: int, values: Any, rows: Any = slice(None)) -> Run:
    """The run with other values in a column of a channel, in some rows."""
    array = getattr(run, channel).copy()
    array[rows, column] = values
    return replace(run, **{channel: array})


def column(channel: str, at: int, values: Any) -> Change:
    return lambda run: with_column(run, channel, at, values)


def times(**factors: Any) -> Change:
    """Channels times a factor, or one for each joint."""
    return lambda run: replace(
        run, **{name: getattr(run, name) * np.asarray(factor) for name, factor in factors.items()}
    )


def bare(change: Change) -> Change:
    """The same of a recording without speeds."""
    return lambda run: change(without_speed(run))


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


def test_no_false_alarm_at_rest() -> None:
    """Neither without noise, nor is a coarse torque a saturated one."""
    run = recorded()
    t = np.concatenate([np.arange(400) / 200, run.t + 2])
    q, tau = (np.vstack([np.tile(x[0], (400, 1)), x]) for x in (run.q, run.tau))
    assert check(Run("run", t, q, tau))[1] == []
    run = without_speed(recorded(rate=1000.0))
    q, tau = run.q.copy(), np.round(run.tau / 0.1) * 0.1
    q[:600], tau[:600, 0] = q[600], tau[:, 0].max() + 1
    (back,), findings = check(replace(run, q=q, tau=tau))
    assert findings == []
    assert back.valid is None


FAULTS: list[tuple[Change, str, str, tuple[str, ...]]] = [
    *(
        (change, "error", "units", (f"Write measurement.time: {unit}",))
        for unit, factor in (("ms", 1e3), ("us", 1e6), ("ns", 1e9))
        for change in (times(t=factor), bare(times(t=factor)))
    ),
    (bare(times(q=DEGREES)), "error", "units", ("Write measurement.angle: deg",)),
    (times(q=DEGREES, dq=DEGREES), "error", "units", ("Write measurement.angle: deg",)),
    (times(q=DEGREES), "error", "units", ("speeds in rad/s", "measurement.angle: deg",
                                          "{dq: null}")),
    (times(dq=DEGREES), "error", "units", ("degrees per second", "{dq: null}")),
    (times(dq=30 / np.pi), "error", "units", ("turns per minute",)),
    (times(dq=[1, 1.6, 1]), "warning", "gain", ("elbow is 1.6 times",)),
    (lambda run: replace(run, q=run.q + np.array([0, 3.5, 0])), "warning", "outside_limits",
     ("measurement.offset",)),
    (times(tau=100), "note", "torque_units", ()),
    (times(tau=0.01), "warning", "torque_units", ("measurement.torque: motor",)),
    (column("tau", 1, 0.0), "error", "dead_torque", ("torque of elbow is constant at 0",)),
    (column("tau", 1, np.nan), "error", "dead_torque", ("torque of elbow is NaN",)),
    (column("q", 2, 0.25), "error", "dead", ("wrist is constant at 0.25", "encoder")),
    (bare(column("q", 2, 0.25)), "error", "dead", ("robot.joints", "{wrist: 0.25}")),
    (lambda run: with_column(run, "tau", 2, run.tau[:, 0]), "error", "duplicate",
     ("shoulder and wrist",)),
    (lambda run: replace(run, dq=run.dq[:, [1, 0, 2]]), "error", "swapped",
     ("the speed of shoulder follows elbow", "{dq: null}")),
    (times(dq=[1, 1, -1]), "error", "sign",
     ("position_sign: {wrist: -1}", "velocity_sign: {wrist: -1}")),
]  # fmt: skip


@pytest.mark.parametrize(("change", "severity", "kind", "parts"), FAULTS)
def test_a_fault_is_named(change: Change, severity: str, kind: str, parts: tuple[str, ...]) -> None:
    found = only(check(change(recorded()))[1], kind)
    assert found.severity == severity
    for part in parts:
        assert part in found.text
    assert kind != "swapped" or found.joints == ("shoulder", "elbow")


def test_units_that_are_declared_and_wrong() -> None:
    run = recorded()
    for spoiled in (run, without_speed(run)):
        findings = check(times(t=1e-3)(spoiled), time="ms")[1]
        (found,) = [found for found in findings if found.kind == "units"]
        assert found.severity == "error"
        assert "Write measurement.time: s" in found.text
    found = only(check(bare(times(q=1 / DEGREES))(run), angle="deg")[1], "units")
    assert "measurement.angle: rad" in found.text


@pytest.mark.parametrize("change", [lambda run: run, without_speed])
def test_joints_in_degrees_are_told_one_by_one_or_together(change: Change) -> None:
    """Together also where one of them hardly moves."""
    run = change(recorded())
    degrees = np.array([1.0, DEGREES, 1.0])
    told = only(
        check(times(q=degrees, **({"dq": degrees} if run.dq is not None else {}))(run))[1], "units"
    )
    assert (told.severity, told.joints) == ("error", ("elbow",))
    assert told.settings["measurement.angle"] == {"elbow": "deg"}
    told = only(check(bare(times(q=DEGREES * np.array([1.0, 1.0, 0.002])))(run))[1], "units")
    assert told.settings == {"measurement.angle": "deg"}
    spec = MeasurementSpec(angle={"elbow": "deg", "wrist": 0.5})
    assert angle_units(spec, JOINTS) == pytest.approx([1.0, np.pi / 180, 0.5])


def test_stamps_that_are_numbers_of_samples() -> None:
    """Read as seconds; a slow log, where a joint comes to a third of its speed limit, has none."""
    rates, number = np.array([1.0, 1.3, 1.7]), np.arange(2000.0)
    q, dq = (f(np.outer(0.01 * number, rates)) for f in (np.sin, np.cos))
    numbered = Run("r", number, q, np.ones_like(q), rates * dq)
    (told,) = check_units([without_speed(numbered)], MeasurementSpec(), JOINTS, LIMITS)
    assert told.severity == "error"
    assert "numbers of the samples" in told.text
    (told,) = check_units([numbered], MeasurementSpec(), JOINTS, LIMITS)
    assert told.settings["measurement.clock"] == pytest.approx(0.01, rel=1e-3)
    t = np.arange(0.0, 200.0)
    slow = Run("slow", t, np.sin(np.outer(t, [0.9, 0.5, 0.4])), np.ones((200, 3)))
    assert check_units([slow], MeasurementSpec(), JOINTS, LIMITS) == []


def test_torques_too_small_for_a_square_and_joints_that_all_stand() -> None:
    run = recorded()
    found = check(times(tau=1e-200)(run))[1]
    assert {(each.kind, each.severity) for each in found} == {("dead_torque", "error")}
    assert all("those of all joints are constant (at 0" in each.text for each in found)
    found = check(replace(run, q=np.tile(run.q[0], (len(run.t), 1))))[1]
    assert {each.severity for each in found if each.kind == "dead"} == {"error"}


def test_a_joint_held_in_one_run_is_masked_there() -> None:
    first, second = without_speed(recorded(name="a")), without_speed(recorded(name="b", seed=1))
    held = with_column(with_column(second, "q", 2, 0.25), "tau", 2, 0.0)
    runs, findings = check(first, held)
    assert only(findings, "held").severity == "warning"
    assert runs[0].valid is None
    assert runs[1].usable().all(axis=0).tolist() == [True, True, False]


def test_a_joint_that_stands_beside_the_noise_of_its_speed_has_no_dead_encoder() -> None:
    run = with_column(recorded(), "q", 2, 0.25)
    noise = np.random.default_rng(0).normal(0.0, 0.006, len(run.t))
    _, findings = check(with_column(run, "dq", 2, noise))
    found = only(findings, "held")
    assert (found.severity, found.joints) == ("warning", ("wrist",))
    assert "wrist stands at 0.25 in all runs" in found.text


def test_dead_speed_is_not_used() -> None:
    (back,), findings = check(times(dq=[1, 0, 1])(recorded()))
    assert "elbow is constant" in only(findings, "dead_speed").text
    assert back.dq is None


@pytest.mark.parametrize("steps", [-8, 0, 5])
def test_late_speeds(steps: int) -> None:
    run = recorded()
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
    spoiled = with_column(replace(run, tau=tau), "tau", 0, np.minimum(tau[:, 0], level))
    (back,), findings = check(spoiled)
    found = only(findings, "saturated")
    share = np.mean(tau[:, 0] >= level)
    assert found.joints == ("shoulder",)
    assert f"upper limit {level:.6g} N·m in {share:.1%}" in found.text
    np.testing.assert_array_equal(back.usable()[:, 0], tau[:, 0] < level)
    assert back.usable()[:, 1:].all()
    _, findings = mask_saturated(spoiled, JOINTS, np.zeros(len(JOINTS), dtype=bool))
    assert f"upper limit {level:.6g} N in {share:.1%}" in only(findings, "saturated").text


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
    found = only(findings, "stale")
    assert found.severity == "warning"
    assert f"{np.sum(stale)} of {len(stale)} samples" in found.text
    assert np.array_equal(runs[0].usable(), np.tile(~stale[:, None], run.tau.shape[1]))
    step = np.abs(np.diff(run.q, axis=0)).max()
    assert np.abs(runs[0].q - run.q).max() < 0.5 * step


@pytest.mark.parametrize(
    ("value", "rows", "kind", "words"),
    [
        (None, range(600, 700), "stuck", "torque of elbow stands"),
        (np.inf, range(100, 130), "nan_torque", "30 of 1600"),
    ],
)
def test_torques_that_stand_or_are_missing_are_masked_for_their_joint(
    value: float | None, rows: range, kind: str, words: str
) -> None:
    run = recorded()
    value = run.tau[599, 1] if value is None else value
    (back,), findings = check(with_column(run, "tau", 1, value, slice(rows.start, rows.stop)))
    assert words in only(findings, kind).text
    assert np.flatnonzero(~back.usable()[:, 1]).tolist() == list(rows)
    assert back.usable()[:, [0, 2]].all()
    assert np.isfinite(back.tau).all()


def test_missing_positions_are_bridged_or_split() -> None:
    run = recorded()
    spoiled = with_column(run, "q", 0, np.nan, slice(500, 502))
    (back,), findings = check(spoiled)
    assert [found.kind for found in findings] == ["nan_position", "bridged"]
    np.testing.assert_allclose(back.q, run.q, atol=1e-5)
    assert np.flatnonzero(~back.usable().any(axis=1)).tolist() == [500, 501]
    parts, findings = check(with_column(spoiled, "q", 2, np.nan, slice(800, 900)))
    assert "gap" in [found.kind for found in findings]
    assert [part.label for part in parts] == ["run/1", "run/2"]
    with pytest.raises(FileError, match="nothing is left"):
        check(replace(run, q=np.full_like(run.q, np.nan)))


def test_missing_speed_and_stamps() -> None:
    run = recorded()
    assert only(check(with_column(run, "dq", 1, np.nan, 7))[1], "nan_speed").severity == "note"
    (back,), findings = check(with_column(run, "dq", 1, np.nan))
    only(findings, "nan_speed")
    assert back.dq is None
    t = run.t.copy()
    t[40] = np.nan
    assert [found.kind for found in check(replace(run, t=t))[1]] == ["nan", "bridged"]
    t[40] = np.finfo(np.float32).max  # as recorders write where they have none
    assert "1 rows without a time stamp" in check(replace(run, t=t))[1][0].text


def test_stamps_in_another_unit_are_not_lost_as_missing() -> None:
    """Nanoseconds declared as seconds pass 1e12 after 17 minutes: refused, not cut."""
    run = recorded()
    with pytest.raises(FileError, match=r"1\.599e\+12 s: no clock gives .* measurement\.time"):
        check(replace(run, t=np.round(run.t * 2e11)))


# --- resolution


@pytest.mark.parametrize("step", [5.0, 0.31, 0.02])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_steps_of_torques_are_found_from_the_values(step: float, kind: type) -> None:
    values = (step * np.round(recorded().tau[:, 0] / step) + 0.7).astype(kind)
    assert lattice_step(values.astype(float)) == pytest.approx(step, rel=1e-5)


def test_what_comes_in_no_steps() -> None:
    tau = recorded().tau[:, 0]
    for values in (tau, np.repeat(tau, 4), np.full(100, 3.0)):
        assert lattice_step(values) == 0.0


def test_coarse_torques_are_told_and_kept_with_the_run() -> None:
    run = recorded()
    (back,), findings = check(replace(run, tau=np.round(run.tau / 5.0) * 5.0))
    found = only(findings, "torque_steps")
    assert found.severity == "warning"
    assert "shoulder of 5 (" in found.text
    np.testing.assert_allclose(back.torque_step, 5.0)  # type: ignore[arg-type]
    (fine,), findings = check(replace(run, tau=np.round(run.tau / 0.1) * 0.1))
    assert findings == []
    assert fine.torque_step is not None


def test_a_torque_that_is_mostly_one_number() -> None:
    run = recorded()
    tau = run.tau - np.median(run.tau, axis=0)
    tau[np.abs(tau[:, 1]) < np.quantile(np.abs(tau[:, 1]), 0.8), 1] = 0.0
    (found,) = [f for f in check(replace(run, tau=tau))[1] if f.kind != "stuck"]
    assert (found.kind, found.severity) == ("mostly_constant", "warning")
    assert found.joints == ("elbow",)
    assert "exactly 0 in 80% of the samples" in found.text
    assert "measurement.without_torque" in found.text


# --- angles of one turn

T = np.arange(1000) * 0.01
TRUE = 2.5 + 1.5 * np.sin(2 * T)
WRAPPED = (TRUE + np.pi) % (2 * np.pi) - np.pi


def continuous(q: Array, lower: float = -9.0, upper: float = 9.0) -> tuple[Array, list[Finding]]:
    ends, fast = (np.array([lower]), np.array([upper])), np.full(1, 9.0)
    run = Run("a", T, q[:, None], np.zeros((len(T), 1)))
    (found,), told = unwrapped([run], ("j",), RecordingLimits(*ends, fast, fast, np.ones(1, bool)))
    return found.q[:, 0], told


@pytest.mark.parametrize("wrapped", [WRAPPED, WRAPPED + np.pi])
def test_a_wrapped_angle_is_made_continuous(wrapped: Array) -> None:
    found, told = continuous(wrapped)
    np.testing.assert_allclose(found - TRUE, found[0] - TRUE[0], atol=1e-9)
    assert [(each.kind, each.joints) for each in told] == [("wrapped", ("j",))]


def test_a_wrapped_angle_lies_within_the_limits() -> None:
    np.testing.assert_allclose(continuous(WRAPPED, 0.0, 6.0)[0], TRUE, atol=1e-9)


@pytest.mark.parametrize("q", [TRUE + 4.0 * (T > 5.0), 600.0 * TRUE], ids=["jumps", "counts"])
def test_other_jumps_are_left_alone(q: Array) -> None:
    found, told = continuous(q)
    np.testing.assert_array_equal(found, q)
    assert told == []


# --- together


def test_errors_are_raised_together() -> None:
    runs, findings = check(column("tau", 1, 0.0)(recorded()), time="s")
    findings.append(Finding("sign", "error", "another fault", "b"))
    data = Dataset(JOINTS, tuple(runs), ("a.csv",), tuple(findings))
    with pytest.raises(FileError) as caught:
        raise_for_errors(data)
    lines = str(caught.value).splitlines()
    assert lines[0] == "a.csv: these data cannot be used:"
    assert lines[1].startswith("- run: torque of elbow is constant at 0")
    assert lines[2] == "- b: another fault."
    warning = Finding("gap", "warning", "a gap")
    assert sentence(warning) == "a gap."
    raise_for_errors(replace(data, findings=(warning,)))


def test_of_one_fault_the_first_is_told_and_where_the_others_are() -> None:
    findings = [
        Finding("stuck", "warning", "torque of a stands at 1", "run_1", ("a",)),
        Finding("stuck", "warning", "torque of b stands at 2", "run_1", ("b",)),
        Finding("stuck", "warning", "torque of b stands at 3", "run_2", ("b",)),
        Finding("gap", "warning", "a gap", "run_2"),
    ]
    stuck, gap = merged(findings)
    assert stuck.text == "torque of a stands at 1; likewise b (run_1, run_2)"
    assert (stuck.run, stuck.joints) == ("run_1", ("a", "b"))
    assert gap == findings[-1]
    (one,) = merged(Finding("jitter", "note", "stamps jitter", run) for run in ("a", "b"))
    assert (one.text, one.run) == ("stamps jitter", "a, b")
    many = [Finding("nan", "warning", f"{k}", "", (f"j{k}",)) for k in range(20)]
    assert merged(many)[0].text.endswith("j8, and 11 more")
    apart = [  # severities, and what is about no place
        Finding("held", "warning", "x", "a"),
        Finding("held", "note", "y", "a"),
        Finding("assumed", "warning", "one thing"),
        Finding("assumed", "warning", "another"),
    ]
    assert merged(apart) == apart


def test_settings_of_both_hold_and_numbers_are_those_of_the_later() -> None:
    one = {"robot.base_orientation": [0.1, 0.0, 0.0], "measurement.without_torque": ["a"]}
    other = {"robot.base_orientation": [0.2, 0.0, 0.0], "measurement.without_torque": ["b", "a"]}
    assert joined(one, other) == {
        "robot.base_orientation": [0.2, 0.0, 0.0],
        "measurement.without_torque": ["a", "b"],
    }


def test_counts_of_an_encoder_are_told_with_their_number_a_turn() -> None:
    run = without_speed(recorded())
    unit = 2 * np.pi / 2**12
    q = run.q * 2.5 / np.abs(run.q).max()  # twice as much would not keep the limits
    found = only(check(replace(run, q=np.round(q / unit)))[1], "units")
    assert found.settings == {"measurement.angle": pytest.approx(unit)}
    assert "With 4096 a turn" in found.text


def test_what_was_masked_before_stays_so_where_torques_are_missing() -> None:
    run = recorded()
    tau, valid = run.tau.copy(), np.ones(run.tau.shape, bool)
    tau[7, 0], valid[3, 1] = np.nan, False
    back, _ = without_missing(replace(run, tau=tau, valid=valid), JOINTS)
    assert np.argwhere(~back.usable()).tolist() == [[3, 1], [7, 0]]
