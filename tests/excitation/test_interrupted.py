"""A search that is interrupted: the best so far is kept, proved, and made anew on --resume."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from excite_cli.api.loading import load_problem
from excite_cli.api.planning import Progress, plan
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Status
from excite_cli.store.result_file import read_result
from excite_cli.workers.catalogue import open_workers

SMOKE = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _problem(*settings: str) -> Problem:
    common = ["constraints.torque=null", "optimizer.max_iterations=60", "optimizer.restarts=1"]
    return load_problem(SMOKE, [*common, "sequence.motions=2", *settings])


def _after(motion: int, calls: int) -> Callable[[int, Progress], None]:
    """Ctrl-C at the `calls`-th report of a motion."""
    count = 0

    def report(index: int, progress: Progress) -> None:
        nonlocal count
        count += index == motion
        if count == calls:
            raise KeyboardInterrupt

    return report


@pytest.mark.parametrize("motion", [1, 2])
def test_the_best_so_far_is_stored_and_made_anew(tmp_path: Path, motion: int) -> None:
    problem, path = _problem(), tmp_path / "cut.h5"
    lowest = []
    stop = _after(motion, 25)

    def report(index: int, progress: Progress) -> None:
        if index == motion:
            lowest.append(progress.figure.value)
        stop(index, progress)

    with pytest.raises(KeyboardInterrupt):
        plan(problem, output=path, progress=report)
    left = read_result(path)
    assert len(left.motions) == motion
    last = left.motions[-1]
    assert last.status is Status.INTERRUPTED
    assert last.iterations >= 25
    assert all(last.certified.values())
    assert last.stacked_condition_number < 1.3 * min(lowest)
    resumed = plan(problem, output=path, resume=True)
    whole = plan(problem)
    assert [m.status for m in resumed.motions] == [m.status for m in whole.motions]
    for own, other in zip(resumed.motions, whole.motions, strict=True):
        np.testing.assert_array_equal(own.coefficients, other.coefficients)
    np.testing.assert_array_equal(resumed.stack.factor, whole.stack.factor)


def test_of_several_starts_it_is_the_best(tmp_path: Path) -> None:
    """Also of those that other processes have told before they were ended."""
    problem, path = _problem("optimizer.restarts=4"), tmp_path / "cut.h5"
    figures: list[float] = []

    def report(index: int, progress: Progress) -> None:
        if progress.stage is not None and progress.stage.number == 0:
            figures.append(progress.figure.value)
            if len(figures) == 3:
                raise KeyboardInterrupt

    with open_workers(2) as workers, pytest.raises(KeyboardInterrupt):
        plan(problem, output=path, progress=report, workers=workers)
    (motion,) = read_result(path).motions
    assert motion.status is Status.INTERRUPTED
    assert motion.condition_number < 1.05 * min(figures)


def test_without_an_admissible_point_nothing_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*given: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("excite_cli.excitation.one_start.random_start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        plan(_problem(), output=tmp_path / "cut.h5")
    assert not list(tmp_path.iterdir())
