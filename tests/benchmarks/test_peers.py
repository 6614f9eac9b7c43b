"""The comparison with peers: its table says what the races say, and its contestants are equal."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.peers.motion_table import PART, Comparison, Entry, dated_goals, goals, markdown
from benchmarks.peers.our_driver import Clock, timed, with_columns
from benchmarks.peers.races import BLIND, CLEAR, LIMITS, OURS, OWN, Measure, Race, find
from benchmarks.problems import motion, problem
from excite_cli.excitation.problem import Problem


def race(contestant: str, seed: int, *rows: tuple[float, float]) -> Race:
    """A race of (processor time, condition number), twice that by our columns and in wall time."""
    curve = np.array([[2 * t, t, value, 2 * value] for t, value in rows]).reshape(-1, 4)
    return Race(contestant, seed, curve, wall=120.0, processor=60.0, before=1.0)


def compared(*races: Race) -> Comparison:
    return Comparison("2026-01-01", "Here.", tuple(Entry(each, None) for each in races))


@pytest.fixture(scope="module")
def small() -> Problem:
    return problem("smoke", "constraints.self_collision=null")


def test_goals_compare_the_best_of_the_peer_with_the_worst_of_ours() -> None:
    text = goals(
        compared(
            race(BLIND, 1, (5.0, 30.0), (50.0, 20.0)),
            race(BLIND, 2, (40.0, 25.0)),
            race(OURS, 1, (1.0, 28.0), (2.0, 19.0)),
            race(OURS, 2, (4.0, 18.0)),
        )
    )
    first = text.splitlines()[2]
    assert "its best, 20.00" in first  # of its two seeds the better
    assert "| 50 | 3.00 (4.00) |" in first  # and the worse of ours
    assert "12 ×" in first
    assert first.endswith("MISSED |")
    assert "18.50 (19.00)" in text  # at equal time


def test_goal_is_met_from_twenty_times_on_and_missed_if_one_seed_never_arrives() -> None:
    theirs = race(BLIND, 1, (40.0, 20.0))
    quick, never = race(OURS, 1, (2.0, 20.0)), race(OURS, 2, (2.0, 21.0))
    assert "met" in goals(compared(theirs, quick)).splitlines()[2]
    last = goals(compared(theirs, quick, never)).splitlines()[2]
    assert "MISSED" in last
    assert "1 of 2" in last


def test_every_measure_has_its_goals_and_its_contestant() -> None:
    text = goals(
        compared(
            race(BLIND, 1, (40.0, 20.0)),
            race(OURS, 1, (2.0, 20.0)),
            race(OWN, 1, (1.0, 20.0), (3.0, 15.0)),
        )
    )
    lines = text.splitlines()[2:]
    assert [line.split(" | ")[0] for line in lines] == ["| FIGAROH's"] * 2 + ["| excite's"] * 2
    assert "its best, 20.00 | 40 | 2.00 | 20 ×" in lines[0]
    assert "its best, 40.00 | 40 | 1.00 | 40 ×" in lines[2]
    assert "| 40.00 | 30.00 |" in lines[3]


def test_a_curve_is_read_in_the_measure_that_is_asked_for() -> None:
    curve = np.array([[1.0, 1.0, 30.0, 10.0], [2.0, 2.0, 20.0, 15.0]])
    found = Race(OURS, 1, curve, wall=3.0, processor=3.0, before=0.0)
    assert found.best(Measure.FIGAROH) == 20.0
    assert found.best(Measure.EXCITE) == 10.0
    assert found.reached(16.0, Measure.EXCITE) == (1.0, 1.0)
    assert found.reached(20.0, Measure.FIGAROH) == (2.0, 2.0)
    assert found.at(1.5, Measure.FIGAROH) == 30.0


def test_table_says_that_a_contestant_found_nothing() -> None:
    text = markdown(compared(race(CLEAR, 1), race(OURS, 1, (1.0, 15.0))))
    assert "Measured on 2026-01-01. Here." in text
    row = next(line for line in text.splitlines() if line.startswith("| FIGAROH |"))
    assert set(row.split(" | ")[1:]) <= {"never", "never |"}
    assert "goal" not in text  # nothing to be compared with


def test_differences_have_the_gradient_that_is_exact_and_write_one_note(small: Problem) -> None:
    clock, alpha = Clock(), motion(small)
    criterion = small.criterion.continuation()[0]
    exact, differenced = (
        timed(small, kind, clock).objective().value_and_gradient(alpha, criterion)
        for kind in ("exact", "differences")
    )
    assert differenced[0] == pytest.approx(exact[0], rel=1e-12)
    free = small.boundary.free.T
    np.testing.assert_allclose(
        free @ differenced[1], free @ exact[1], atol=2e-4 * np.abs(free @ exact[1]).max()
    )
    assert len(clock.notes) == 2


def test_other_columns_span_the_same_base_parameters(small: Problem) -> None:
    first = small.base.selection.tolist()
    other = with_columns(small, first[::-1])
    alpha = motion(small)
    assert other.objective().own_condition_number(alpha) == pytest.approx(
        small.objective().own_condition_number(alpha), rel=1e-9
    )
    with pytest.raises(ValueError, match="do not span"):
        with_columns(small, [*first[:-1], first[0]])


def test_config_asks_for_no_more_than_four_fifths_of_the_limits_of_the_example() -> None:
    asked = problem("ur10_figaroh", "constraints.self_collision=null").robot
    for joint, name in enumerate(asked.joint_names):
        limit = LIMITS[name]
        assert asked.limits.upper[joint] <= 0.8 * limit["position"][1]
        assert asked.limits.lower[joint] >= 0.8 * limit["position"][0]
        assert asked.limits.velocity[joint] <= 0.8 * limit["velocity"]
        assert asked.limits.effort[joint] == limit["effort"]


def test_figaroh_that_is_not_there_is_none(small: Problem) -> None:
    assert find(Path("/nowhere/python"), small.robot.description) is None


def test_the_goals_are_put_between_the_marks_of_a_page_and_nowhere_else(tmp_path: Path) -> None:
    found = compared(race(BLIND, 1, (40.0, 20.0)), race(OURS, 1, (2.0, 20.0)))
    path = tmp_path / "page.md"
    path.write_text(f"above\n{PART.begin}\nold\n{PART.end}\nbelow")
    PART.write(path, dated_goals(found))
    page = path.read_text()
    assert page.startswith(f"above\n{PART.begin}\nMeasured on 2026-01-01.")
    assert page.endswith(f"{PART.end}\nbelow")
    assert "old" not in page
    PART.write(path, dated_goals(found))
    assert path.read_text() == page
    path.write_text("no marks")
    with pytest.raises(ValueError, match="lacks"):
        PART.write(path, dated_goals(found))
