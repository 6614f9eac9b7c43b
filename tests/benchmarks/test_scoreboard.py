"""The score board: its judge is the same for all, and its table says what the records say."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.sparse import csr_matrix

from benchmarks.peers.exchange import (
    BEGIN,
    END,
    Given,
    Recording,
    States,
    lines_of_user,
    read_answer,
    read_given,
    write_answer,
    write_given,
)
from benchmarks.peers.log_judge import Judge, Verdict, _recording, physical
from benchmarks.peers.log_table import by_joint, names, page_part, short_table, simulated
from benchmarks.peers.plain_urdf import plain_urdf
from benchmarks.peers.tools import (
    BODIES,
    EXCITE,
    FIGAROH,
    SYSID,
    TOLD,
    URDF,
    WLS,
    Entry,
    Result,
    merged,
    read_entries,
    write_entries,
)
from excite_cli.api.loading import load_case
from excite_cli.identification.prepare import PreparedRun
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import RunId

NAMES = ("a", "b")


def held_out(tau: np.ndarray, moving: np.ndarray, valid: np.ndarray | None = None) -> PreparedRun:
    """A run whose averages are its samples."""
    count, n = tau.shape
    valid = np.ones(tau.shape, bool) if valid is None else valid
    one = csr_matrix(np.eye(count))
    zero, each = np.zeros(tau.shape), (one,) * n
    return PreparedRun(
        RunId("r"), np.arange(count) * 0.01, zero, zero, zero, tau, one, tau, valid, each,
        moving, each, tau, valid, 0.01,
    )  # fmt: skip


def judged(run: PreparedRun, tau: np.ndarray) -> Verdict:
    robot: Any = SimpleNamespace(robot=SimpleNamespace(joint_names=NAMES))
    return Judge(robot, (run,), ()).verdict([tau])


def test_judge_counts_errors_where_joints_move_and_samples_are_valid() -> None:
    tau = np.full((100, 2), 2.0)
    moving = np.ones((100, 2), bool)
    moving[50:, 0] = False
    valid = np.ones((100, 2), bool)
    valid[:10, 1] = False
    told = tau * np.array([1.1, 0.7])
    told[50:, 0] = 99.0  # it stands there
    told[:10, 1] = 99.0  # nobody knows what was there
    found = judged(held_out(tau, moving, valid), told)
    assert found.by_joint["a"] == pytest.approx(0.1)
    assert found.by_joint["b"] == pytest.approx(0.3)
    assert found.mean == pytest.approx(0.2)
    assert found.possible is None


def test_judge_tells_the_error_of_the_torque_as_recorded() -> None:
    tau = np.full((40, 2), 2.0)
    run = replace(held_out(tau, np.ones((40, 2), bool)), tau_raw=np.full((40, 2), 4.0))
    found = judged(run, tau)
    assert found.mean == 0.0
    assert found.raw == pytest.approx(0.5)


def test_a_sphere_can_be_and_a_body_beyond_the_triangle_inequality_cannot() -> None:
    sphere = [2.0, 0, 0, 0, 0.01, 0, 0.01, 0, 0, 0.01]
    impossible = [2.0, 0, 0, 0, 0.05, 0, 0.01, 0, 0, 0.01]
    assert physical(np.array([sphere]))
    assert not physical(np.array([sphere, impossible]))


def test_torques_that_are_held_out_are_not_told_to_any_tool() -> None:
    t = np.arange(300) * 0.01
    tau = np.random.default_rng(1).normal(size=(300, 2))
    run = Run("r", t, np.zeros((300, 2)), tau)
    told = _recording(run, [run.cut(0, 100), run.cut(200, 300)])
    np.testing.assert_array_equal(told.tau[:100], tau[:100])
    np.testing.assert_array_equal(told.used, (np.arange(300) < 100) | (np.arange(300) >= 200))
    line = np.linspace(tau[99], tau[200], 102)
    np.testing.assert_allclose(told.tau[99:201], line)
    assert [(part.start, part.stop) for part in told.stretches] == [(0, 100), (200, 300)]


def test_the_plain_urdf_has_the_dynamics_of_the_robot_with_locked_joints(tmp_path: Path) -> None:
    posture = {"arm_left_4_joint": -1.0}
    moved = [f"arm_left_{k}_joint" for k in (1, 2, 3, 5, 6)]
    robot = load_case(
        {"robot": {"urdf": "example-robot-data:talos", "joints": moved, "posture": posture}}
    ).robot
    path = tmp_path / "robot.urdf"
    path.write_text(plain_urdf(robot))
    model = pin.buildModelFromUrdf(str(path))
    assert list(model.names)[1:] == moved
    rng = np.random.default_rng(3)
    for _ in range(5):
        states = rng.normal(size=(3, 5))
        ours = pin.rnea(robot.model, robot.model.createData(), *states)
        np.testing.assert_allclose(pin.rnea(model, model.createData(), *states), ours, atol=1e-9)


def test_what_is_given_and_answered_comes_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=(5, 2))
    recordings = (
        Recording(np.arange(5.0), x, None, 2 * x, np.ones(5, bool)),
        Recording(np.arange(5.0), x, 3 * x, x, np.arange(5) > 2),
    )
    given = Given(tmp_path / "robot.urdf", NAMES, recordings, (States(x, 4 * x, 5 * x),))
    write_given(tmp_path, "<robot/>", given)
    again = read_given(tmp_path)
    assert again.joints == NAMES
    assert again.recordings[0].dq is None
    np.testing.assert_array_equal(again.recordings[1].dq, 3 * x)
    np.testing.assert_array_equal(again.asked[0].v, 4 * x)
    write_answer(tmp_path / "a.npz", [x, 2 * x], np.ones((1, 10)), "Tool 1")
    torques, phi, told = read_answer(tmp_path / "a.npz")
    np.testing.assert_array_equal(torques[1], 2 * x)
    assert phi is not None
    assert told == "Tool 1"


def test_lines_of_a_user_are_those_between_the_marks(tmp_path: Path) -> None:
    driver = tmp_path / "driver.py"
    driver.write_text(f"import x\n{BEGIN}\na = 1\n\n# why\n{END}\nb = 2\n{BEGIN}\nc = 3\n{END}\n")
    assert lines_of_user(driver) == 2


def result(tool: str, mean: float, **more: object) -> Result:
    verdict = Verdict(mean, {"a": mean, "b": float("nan")}, 2 * mean, more.pop("possible", None))  # type: ignore[arg-type]
    return Result(tool, verdict, 12.0, 3, **more)  # type: ignore[arg-type]


def entry(name: str, real: bool, *results: Result) -> Entry:
    return Entry(name, f"robot {name}", real, results, {r.tool: "2026-01-01" for r in results})


def all_tools(name: str, real: bool, *errors: float) -> Entry:
    tools = (EXCITE, FIGAROH, SYSID, WLS, URDF)
    return entry(name, real, *(result(t, e) for t, e in zip(tools, errors, strict=True)))


def test_the_least_error_is_bold_whoever_has_it() -> None:
    lines = short_table(
        [
            all_tools("x", True, 0.1, 0.05, 0.2, 0.3, 0.8),
            all_tools("y", True, 0.1, 0.2, 0.3, 0.4, 1),
        ]
    ).splitlines()
    assert lines[2] == "| robot x | 10 % | **5.0 %** | 20 % | 30 % | 80 % |"
    assert "| **10 %** | 20 %" in lines[3]


def test_what_a_tool_was_told_by_hand_stands_beside_what_it_does_alone() -> None:
    told = short_table(
        [entry("x", True, result(EXCITE, 0.1), result(FIGAROH, 0.4), result(TOLD, 0.2))]
    )
    assert "| 40 % (20 % with coupling declared) |" in told


def test_simulated_robots_are_one_row_of_medians_over_those_that_all_answered() -> None:
    some = [all_tools(str(k), False, *(0.1 * k * j for j in range(1, 6))) for k in (1, 2, 5)]
    lacking = entry("4", False, result(EXCITE, 9.0))
    line = short_table([*some, lacking]).splitlines()[-1]
    assert line.startswith("| 3 simulated robots, median | **20 %** | 40 % |")


def test_a_tool_that_failed_says_why_and_has_no_figures() -> None:
    failed = Result(SYSID, None, 4.0, 60, "too heavy")
    told = by_joint(entry("x", True, result(EXCITE, 0.1, possible=False), failed))
    ours, theirs = told.splitlines()[2:]
    assert "| no |" in ours
    assert "| 10 % | – |" in ours  # a joint that does not move has no error
    assert "none: too heavy" in theirs


def test_firsts_and_names_are_counted() -> None:
    ours = {"wrong": 1, "true": 12, "told": 12, "planted": 13}
    entries = [
        entry("x", False, result(EXCITE, 0.1, names=ours), result(BODIES, 0.2), result(WLS, 0.05)),
        entry("y", False, result(EXCITE, 0.1, names={"told": 3, "planted": 3}), result(WLS, 0.2)),
    ]
    first = next(line for line in simulated(entries).splitlines() if "first of" in line)
    assert first == "| first of 2 | 1 | 0 | 0 | 0 | 1 | 0 |"
    assert "15 of 16 planted effects" in names(entries)
    assert "Wrong names: 1, on 1 of 2 robots" in names(entries)


def test_a_tool_that_is_not_run_keeps_its_last_result_and_date(tmp_path: Path) -> None:
    old = entry("x", True, result(FIGAROH, 0.3), result(EXCITE, 0.2))
    new = Entry("x", "robot x", True, (result(EXCITE, 0.1),), {EXCITE: "2026-02-02"})
    write_entries(tmp_path / "e.json", [merged(old, new)])
    (again,) = read_entries(tmp_path / "e.json")
    ours, theirs = again.of(EXCITE), again.of(FIGAROH)
    assert ours is not None
    assert ours.verdict is not None
    assert ours.verdict.mean == 0.1
    assert np.isnan(ours.verdict.by_joint["b"])
    assert theirs is not None
    assert again.dates == {FIGAROH: "2026-01-01", EXCITE: "2026-02-02"}
    assert "robot x" in page_part([again], "Here.")
