"""The shortest motion that tells what the robot carries: `excite optimize --for payload`."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from excite_cli.api.arguments import checked
from excite_cli.api.loading import Case, problem_of
from excite_cli.api.outputs import held
from excite_cli.api.planning import plan
from excite_cli.config.load_spec import spec_as_yaml
from excite_cli.config.spec import FourierSpec, SamplingSpec, SequenceSpec, Spec
from excite_cli.errors import ConfigError, NoAdmissibleMotionError
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.identification.carried_load import ExpectedLoad, expected_load, require_same
from excite_cli.identification.stored_model import StoredFit
from excite_cli.robot.link_frame import carrying_frame
from excite_cli.shown.answer import Shown, show
from excite_cli.shown.note import Level, Note, Tell, log_note, unheard
from excite_cli.store.fit_file import read_fit
from excite_cli.summary.problem_notes import problem_parts

# Durations [s] that are tried; shorter runs are little more than the borders of the filters.
SECONDS = (3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
# One standard deviation of a load of `_MASS` [kg] that is good enough: share of it, and m.
_MASS, _ENOUGH, _NEAR = 1.0, 0.004, 1.2e-3


@dataclass(frozen=True, repr=False)
class LoadProblem(Shown):
    """A problem whose motion shows a load, and how well: `expected`. `enough`: as well as asked."""

    problem: Problem
    expected: ExpectedLoad
    enough: bool

    @property
    def sentence(self) -> str:
        """What the motion will tell."""
        e, seconds = self.expected, self.problem.trajectory.duration
        words = (
            f"{seconds:.3g} s will identify a load of {e.mass:g} kg to ± {1e3 * e.mass_std:.2g} g "
            f"and its centre to ± {1e3 * e.center_std:.2g} mm (one standard deviation, with the "
            "noise and the deviations of the fit)"
        )
        if self.enough:
            return words
        return f"{words}: no duration up to {seconds:.3g} s reaches 0.4 % and 1.2 mm"


show(
    LoadProblem,
    lambda found: found.sentence,
    lambda found: [found.sentence, *problem_parts(found.problem)],
)


@checked()
def plan_load(
    case: Problem | Case,
    fit: StoredFit | str | Path,
    link: str | None = None,
    *,
    seconds: Sequence[float] = SECONDS,
    tell: Tell = log_note,
) -> LoadProblem:
    """The problem of the shortest motion that tells a load: `excite optimize --for payload`.

    The ten parameters of what `link` carries (default: the last one) are excited, rows weighted by
    the noise of `fit`, the fit of the robot alone. Give `problem` of what is returned to `plan`.

    Raises
    ------
    NoAdmissibleMotionError
        No duration has a motion that keeps the constraints.
    ConfigError, FileError
        The link is unknown or must be named; the fit belongs to another robot.
    """
    stored = fit if isinstance(fit, StoredFit) else read_fit(Path(fit))
    own = Case(case.spec, case.folder, case.robot, case.file)
    require_same(own.robot, own.base, stored)
    carrying_frame(own.robot, link, "--link")
    found: LoadProblem | None = None
    refused: NoAdmissibleMotionError | None = None
    for duration in seconds:
        spec = _spec(case.spec, stored, link, duration)
        problem = problem_of(replace(own, spec=spec), unheard)
        try:
            result = plan(problem, tell=unheard)
        except NoAdmissibleMotionError as error:
            refused = error
            continue
        expected = _expected(own, problem, result, stored, link)
        good = expected.mass_std <= _ENOUGH * _MASS and expected.center_std <= _NEAR
        found = LoadProblem(problem, expected, good)
        tell(Note(Level.INFO, found.sentence))
        if good:
            return found
    if found is None:
        assert refused is not None
        raise refused
    tell(Note(Level.WARNING, found.sentence))
    return found


@contextmanager
def problem_beside(result: Path, overwrite: bool, inputs: Iterable[Path]) -> Iterator[Path]:
    """Hold the file of a result's config: its name with .yaml.

    Raises
    ------
    ConfigError
        That is the result itself or one of `inputs`.
    FileError
        It exists and may not be replaced, or it cannot be written.
    """
    beside = result.with_suffix(".yaml")
    own = beside.resolve() == result.resolve()
    if own or any(beside.resolve() == Path(each).resolve() for each in inputs):
        raise ConfigError(
            f"--for payload writes the config of its motion beside the result, as {beside}, which "
            f"is {'the result itself' if own else 'read here'}. Give another name, as -o load.h5."
        )
    with held({"output": beside}, overwrite, inputs):
        yield beside


def save_problem(path: str | Path, problem: Problem) -> None:
    """Write the resolved config of `problem`, for `check`, `simulate` and others."""
    from excite_cli.atomic import write_text_atomically

    write_text_atomically(Path(path), spec_as_yaml(problem.spec))


def _spec(spec: Spec, stored: StoredFit, link: str | None, duration: float) -> Spec:
    """The spec of a motion of `duration` for the load, in units of the fit's noise."""
    weights = {
        joint: float(1.0 / max(noise, 1e-12))
        for joint, noise in zip(stored.fit.joint_names, stored.fit.noise, strict=True)
    }
    criterion = {
        "of": "load",
        "load_link": link,
        "row_weights": weights,
        "column_scaling": "unit_norm",
    }
    if isinstance(spec.trajectory, FourierSpec):
        pace = {"base_frequency": 2.0 * np.pi / duration}
    else:
        pace = {"duration": duration}
    return spec.model_copy(
        update={
            "criterion": spec.criterion.model_copy(update=criterion),
            "trajectory": spec.trajectory.model_copy(update=pace),
            "sampling": SamplingSpec(),
            "sequence": SequenceSpec(motions=1),
        }
    )


def _expected(
    case: Case, problem: Problem, result: Result, stored: StoredFit, link: str | None
) -> ExpectedLoad:
    rate = float(stored.processing["rate"])
    t = np.arange(0.0, problem.trajectory.duration, 1.0 / rate)
    states = problem.trajectory.states(t, result.motions[0].coefficients)
    return expected_load(problem.robot, case.base, stored, link, (t, *states), _MASS)
