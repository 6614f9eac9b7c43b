"""Optimised motions beside the best of many random ones: `excite compare-random`."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.loading import inputs_of
from excite_cli.api.outputs import held
from excite_cli.api.planning import plan
from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import FileError
from excite_cli.excitation.motion import Doubt
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import random_baseline
from excite_cli.excitation.result import Comparison, Result, matches
from excite_cli.shown.note import unheard
from excite_cli.store.result_file import read_result, write_result
from excite_cli.summary.motions import comparison_answer as comparison_answer
from excite_cli.summary.pairs import doubts_in_words
from excite_cli.workers.base import Workers


def optimized_for(problem: Problem, optimized: Result | str | Path) -> Result:
    """The result (or that of a file), once it is sure that it answers `problem`.

    Raises
    ------
    FileError
        It cannot be read, was changed, or is of another robot, trajectory or weighting.
    """
    name = "the result" if isinstance(optimized, Result) else str(optimized)
    result = optimized if isinstance(optimized, Result) else read_result(Path(optimized))
    reason = matches(problem, result)
    if reason:
        raise FileError(f"--optimized {name} does not belong to the config: {reason}.")
    changed = [each for each in result.doubted() if each.doubt is Doubt.CHANGED]
    if changed:
        raise FileError(
            f"--optimized {name}: {doubts_in_words(changed)[0]}, so its condition numbers are not "
            "its own. Put the file back as it was, or plan anew with `excite optimize`."
        )
    stored = parse_spec(result.config, f"the config stored in {name}")
    asked = problem.spec
    if (stored.trajectory, stored.sampling) != (asked.trajectory, asked.sampling):
        raise FileError(
            f"--optimized {name} has another trajectory or sampling section than the config. "
            "Compare with the config it was made with."
        )
    return result


@checked()
def compare_random(
    problem: Problem,
    optimized: Result | str | Path | None = None,
    *,
    candidates: int = 300,
    seconds: float | None = None,
    output: str | Path | None = None,
    overwrite: bool = False,
    drawn: Callable[[int, float], None] = unheard,
    workers: Workers | None = None,
) -> Comparison:
    """Random motions under the same constraints, as many as the optimised ones, the best of many.

    Without `optimized` (a result or its file) the problem is optimised first. At least `candidates`
    are drawn, and more while `seconds` last: by default as long as the optimiser took; with 0 the
    number alone counts, so that the result can be reproduced. `drawn(count, best condition
    number)` is called on the way. Both go to the result file `output` if it is given.

    Raises
    ------
    FileError
        `optimized` does not belong to the problem, or `output` exists.
    NoAdmissibleMotionError
        No motion was found.
    """
    with held({"output": output}, overwrite, inputs_of(problem, optimized)):
        if optimized is None:
            result = plan(problem, workers=workers, tell=unheard)
        else:
            result = optimized_for(problem, optimized)
        baseline = random_baseline(
            problem,
            len(result.motions),
            problem.spec.seed,
            candidates,
            sum(motion.seconds for motion in result.motions) if seconds is None else seconds,
            drawn,
            result.prior_stack,
            workers,
        )
        result = replace(
            result,
            random=baseline.motions,
            random_candidates=(baseline.candidates, baseline.admissible),
        )
        if output is not None:
            write_result(Path(output), result, problem)
        return Comparison(result, baseline)
