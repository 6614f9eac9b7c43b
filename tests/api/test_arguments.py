"""Arguments that only a script can get wrong: one sentence, whichever function it is."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from excite_cli import (
    ConfigError,
    ExciteError,
    FileError,
    Problem,
    Result,
    Segment,
    check,
    compare_random,
    diagnose,
    draw_motion,
    export_file,
    identify,
    load_data,
    load_motions,
    load_problem,
    motions_of,
    plan,
    plan_after,
    propose,
    read_diagnosis,
    read_fit,
    read_result,
    run_study,
    simulate,
    verify_gradient,
    write_report,
    write_result,
)
from tests.api.conftest import SMOKE

READERS = (read_result, read_fit, read_diagnosis)
ALONE = (load_problem, *READERS, write_report, propose, verify_gradient)
OF_A_PROBLEM = (load_data, check, plan_after, simulate, identify, diagnose)
CALLS: dict[str, Callable[[Problem, Any], object]] = {
    **{each.__name__: lambda _, given, each=each: each(given) for each in ALONE},
    **{each.__name__: each for each in OF_A_PROBLEM},
    "write_result": lambda problem, given: write_result(given, given, problem),
    "plan": lambda problem, given: plan(problem, priors=given),
    "compare_random": lambda problem, given: compare_random(problem, [given]),  # type: ignore[arg-type]
    "export_file": lambda problem, given: export_file(given, "csv"),
    "draw_motion": lambda problem, given: draw_motion(given, "x.png"),
    "run_study": lambda problem, given: run_study(given, [], ["seed=1"]),
}
LONG = "x" * 5000


@pytest.mark.parametrize("given", [None, b"arm.h5", 3, {}, LONG, "a\0b", "\ud800"], ids=repr)
@pytest.mark.parametrize("name", CALLS)
def test_what_cannot_be_is_one_sentence(problem: Problem, name: str, given: object) -> None:
    with pytest.raises(ExciteError) as error:
        CALLS[name](problem, given)
    assert "\n" not in str(error.value)


def test_the_sentence_says_what_is_allowed(problem: Problem, result: Result) -> None:
    with pytest.raises(ConfigError, match=r"^read_result: path is None .*Give text or Path\.$"):
        read_result(None)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"load_problem: overrides is 'seed=1' .*Give a list"):
        load_problem(SMOKE, "seed=1")
    with pytest.raises(ConfigError, match=r"check: rate is '1000' .*Give a number"):
        check(problem, result, rate="1000")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"one of chosen is True .*Give a whole number"):
        load_motions(problem, result, [True])
    with pytest.raises(ConfigError, match="one of effects is None"):
        simulate(problem, result, [None])  # type: ignore[list-item]
    with pytest.raises(FileError, match="zero character"):
        read_result("a\0b")
    with pytest.raises(FileError, match="name is too long"):
        read_result(LONG)


def test_figures_of_numpy_are_numbers(problem: Problem, result: Result) -> None:
    found = check(problem, result, rate=np.float64(20.0), random=np.int64(3), meshes=False)  # type: ignore[arg-type]
    assert list(found) == ["motion_1"]
    assert len(load_motions(problem, result, np.array([1]))) == 1  # type: ignore[arg-type]


def test_coefficients_are_finite_numbers(problem: Problem, result: Result) -> None:
    (motion,) = motions_of(result)
    wrongs: list[Any] = [motion.coefficients * np.nan, motion.coefficients + 1j]
    for wrong in wrongs:
        other = Segment(motion.name, motion.trajectory, wrong)
        for call in (check, simulate, lambda p, m: plan(p, starts=m)):
            with pytest.raises(FileError, match="motion_1 has coefficients that are no finite"):
                call(problem, other)
    listed = Segment(motion.name, motion.trajectory, motion.coefficients.tolist())
    assert np.array_equal(load_motions(problem, listed)[0].coefficients, motion.coefficients)


def test_no_motion_is_not_judged_good(problem: Problem) -> None:
    with pytest.raises(FileError, match="no motion to check"):
        check(problem, [])


@pytest.mark.parametrize("share", [1e-300, 1e-9, 0.0, float("nan")])
def test_no_motion_is_slowed_for_ever(problem: Problem, result: Result, share: float) -> None:
    with pytest.raises(
        ConfigError, match=r"--slow .*: give a share of the limits from 0\.001 to 1"
    ):
        check(problem, result, meshes=False, slow=share)
