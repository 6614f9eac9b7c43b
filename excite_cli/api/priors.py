"""Earlier data that a plan goes on from: results, measured data, motions."""

from pathlib import Path

from excite_cli.api.loading import load_data
from excite_cli.api.motions import is_motion, load_motions
from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.errors import FileError
from excite_cli.excitation.doubt import Doubt
from excite_cli.excitation.planned_prior import planned_stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.store.diagnosis_file import is_diagnosis
from excite_cli.store.result_file import is_result, read_result
from excite_cli.summary.doubts import doubts_in_words
from excite_cli.trajectory.chain import Segment

Prior = str | Path | Result | Dataset | Segment | Stack


def name_of(prior: Prior, number: int) -> str:
    """What messages and results call the prior: its path, or its number."""
    return str(prior) if isinstance(prior, str | Path) else f"prior {number}"


def load_prior(problem: Problem, prior: Prior, name: str, tell: Tell) -> Result | Stack:
    """What is stacked of a prior; a file itself tells what it holds.

    Raises
    ------
    FileError
        A file cannot be read, or the prior does not fit the problem.
    """
    if isinstance(prior, str | Path):
        path = Path(prior)
        if is_diagnosis(path):
            raise FileError(f"--prior {path} is a diagnosis. Plan on top of it with --after.")
        if not path.exists() or is_result(path):
            prior = read_result(path)
            _tell_changed(prior, name, tell)
            return prior
        if is_motion(path, problem.spec):
            prior = load_motions(problem, path, tell=tell)[0]
        else:
            prior = load_data(problem, path, tell)
    if isinstance(prior, Result):
        _tell_changed(prior, name, tell)
        return prior
    if isinstance(prior, Stack):
        return _fitting(problem, prior, name)
    if isinstance(prior, Segment):
        stack, words = planned_stack(problem, load_motions(problem, prior)[0])
    else:
        stack, words = measured_stack(problem, prior)
    tell(Note(Level.INFO, f"--prior {name}: {words}"))
    return stack


def _tell_changed(prior: Result, name: str, tell: Tell) -> None:
    """Say that motions are not those that the data which are stacked came of."""
    changed = [each for each in prior.doubted() if each.doubt is Doubt.CHANGED]
    for words in doubts_in_words(changed):
        text = f"--prior {name}: {words}; what is stacked is what the file holds of it from before"
        tell(Note(Level.WARNING, text))


def _fitting(problem: Problem, stack: Stack, name: str) -> Stack:
    columns = stack.factor.shape[1]
    if columns != problem.columns:
        raise FileError(
            f"--prior {name} cannot be stacked: it has {columns} columns, the regressor of this "
            f"problem {problem.columns}. A prior must come from the same robot section, effects "
            "and weighting."
        )
    return stack
