"""Earlier data that a plan goes on from: results, measured data, motions."""

from pathlib import Path

from excite_cli.api.loading import load_data
from excite_cli.api.motions import is_motion, load_motions
from excite_cli.diagnosis.measured_prior import measured_stack
from excite_cli.errors import FileError
from excite_cli.excitation.planned_prior import planned_stack
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.excitation.stack import Stack
from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.note import Level, Note, Tell
from excite_cli.store.diagnosis_file import is_diagnosis
from excite_cli.store.result_file import is_result, read_result
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
            return read_result(path)
        if is_motion(path, problem.spec):
            prior = load_motions(problem, path, tell=tell)[0]
        else:
            prior = load_data(problem, path, tell)
    if isinstance(prior, Result):
        return prior
    if isinstance(prior, Stack):
        return _fitting(problem, prior, name)
    if isinstance(prior, Segment):
        stack, words = planned_stack(problem, load_motions(problem, prior)[0])
    else:
        stack, words = measured_stack(problem, prior)
    tell(Note(Level.INFO, f"--prior {name}: {words}"))
    return stack


def _fitting(problem: Problem, stack: Stack, name: str) -> Stack:
    columns = stack.factor.shape[1]
    if columns != problem.columns:
        raise FileError(
            f"--prior {name} cannot be stacked: it has {columns} columns, the regressor of this "
            f"problem {problem.columns}. A prior must come from the same robot section, effects "
            "and weighting."
        )
    return stack
