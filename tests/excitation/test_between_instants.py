"""Motions are moved until every constraint is proved between the instants, however little is told.

The proof stands aside: a column lacks what a test says until its guard is as wide as that says.
"""

from typing import Any

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.errors import NoAdmissibleMotionError
from excite_cli.excitation import one_start
from excite_cli.excitation.motion import Outcome
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.progress import Status
from excite_cli.excitation.solvers.base import Effort
from excite_cli.excitation.start import clear_posture, random_start
from excite_cli.excitation.task import MotionTask
from tests.cli.program import SMOKE

EFFORT = Effort(80, 4.0, 1e-6)


def kept(monkeypatch: pytest.MonkeyPatch, needed: float, told: float) -> list[float]:
    """By how much the guard of the first column was raised, round by round.

    It lacks `told`, or what is left to `needed` if that is less.
    """
    task = MotionTask(build_problem(load_spec(SMOKE), SMOKE.parent))
    start = clear_posture(task, 1)
    first, raised = float(task.guards[0][0]), [0.0]

    class Solver:
        polish = 0

        def solve(self, tighter: MotionTask, x: Any, *_: Any) -> Outcome:
            raised.append(float(tighter.guards[0][0]) - first)
            return Outcome(x, Status.CONVERGED, 1, 1)

    def lacking(*_: Any) -> list[Any]:
        found = [np.zeros_like(guard) for guard in task.guards]
        found[0][0] = min(told, max(needed - raised[-1], 0.0))
        return found

    monkeypatch.setattr(one_start, "lacking_margins", lacking)
    outcome = Outcome(random_start(task, start, (1, 1, 0)), Status.CONVERGED, 1, 1)
    solver: Any = Solver()
    one_start.kept_between_instants(task, solver, start, outcome, EFFORT, lambda told: None)
    return raised


def test_a_trifle_that_stays_a_trifle_is_given_more_room_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    raised = kept(monkeypatch, needed=2e-3, told=1e-5)
    assert raised[-1] > 2e-3
    assert len(raised) <= 6
    steps = np.diff(raised)
    np.testing.assert_allclose(steps[1:] / steps[:-1], 4.0)


def test_what_lacks_less_each_time_is_given_what_it_lacks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    raised = kept(monkeypatch, needed=2e-3, told=1.6e-3)
    np.testing.assert_allclose(raised, [0.0, 1.3 * 1.6e-3])


def test_six_rounds_are_enough_or_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(NoAdmissibleMotionError, match="kept admissible between the instants"):
        kept(monkeypatch, needed=0.1, told=1e-6)
