"""From command-line arguments to a problem, priors and data."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from excite_cli.cli.console import Terminal
from excite_cli.cli.outputs import claim_file
from excite_cli.cli.telling import tell_problem
from excite_cli.config.load import load_spec
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.store.fit_knowledge import fit_knowledge

# Share of a joint's torque on sealed data from which a fit is doubted.
_MUCH_LEFT = 0.1

if TYPE_CHECKING:
    from excite_cli.config.spec import Spec
    from excite_cli.diagnosis.next_motion import NextMotion
    from excite_cli.excitation.result import Result
    from excite_cli.excitation.stack import Stack
    from excite_cli.measurement.dataset import Dataset, Finding
    from excite_cli.robot.model import Robot


def single_threaded(threads: int = 1) -> AbstractContextManager[object]:
    """Limit the linear algebra library: its matrices here are too small for many threads."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=threads)


def load_problem(
    terminal: Terminal, config: Path, overrides: list[str] | None, extra: list[str] | None = None
) -> Problem:
    """Load, override, build; tell what was understood."""
    spec = load_spec(config, [*(overrides or []), *(extra or [])])
    folder = config.resolve().parent
    problem = build_problem(spec, folder, fit_knowledge(spec, folder))
    tell_problem(terminal, problem)
    if spec.uncertainty is not None and spec.uncertainty.fit is not None:
        _tell_fit(terminal, folder / spec.uncertainty.fit)
    return problem


def _tell_fit(terminal: Terminal, path: Path) -> None:
    """Warn where a fit leaves much unexplained: its deviations say nothing of that."""
    from excite_cli.store.fit_file import read_fit

    errors = read_fit(path).error.relative_moving
    much = {joint: error for joint, error in errors.items() if error > _MUCH_LEFT}
    if much:
        worst = max(much, key=lambda joint: much[joint])
        terminal.say(
            f"warning: {path} leaves {100 * much[worst]:.0f} % of the torque of {worst} "
            f"unexplained ({len(much)} joints above {100 * _MUCH_LEFT:.0f} %). Its standard "
            "deviations do not cover an effect that the model lacks: run `excite diagnose` first."
        )


def load_next_motion(
    terminal: Terminal, config: Path, after: Path, changes: list[str]
) -> "NextMotion":
    """The problem of `config` after the diagnosis `after`; tell what is planned and why."""
    from excite_cli.diagnosis.next_motion import plan_after
    from excite_cli.store.diagnosis_file import read_diagnosis

    spec, folder = load_spec(config, changes), config.resolve().parent
    found = plan_after(read_diagnosis(after), spec, folder, fit_knowledge(spec, folder))
    tell_problem(terminal, found.model)
    for message in found.messages:
        terminal.say(message)
    return found


def load_priors(
    terminal: Terminal, problem: Problem, files: Sequence[Path]
) -> list[tuple[str, "Result | Stack"]]:
    """Earlier results, stacks of motions and of measured data; the file itself tells what it is.

    Raises
    ------
    FileError
        A file cannot be read, or is a diagnosis.
    """
    from excite_cli.cli.motions import is_motion, load_motions
    from excite_cli.excitation.planned_prior import planned_stack
    from excite_cli.store.diagnosis_file import is_diagnosis
    from excite_cli.store.result_file import is_result, read_result

    found: list[tuple[str, Result | Stack]] = []
    for path in files:
        if is_diagnosis(path):
            raise FileError(f"--prior {path} is a diagnosis. Plan on top of it with --after.")
        if not path.exists() or is_result(path):
            found.append((str(path), read_result(path)))
            continue
        if is_motion(path, problem.spec):
            motion = load_motions(terminal, path, problem.robot, problem.spec)[0]
            stack, words = planned_stack(problem, motion)
        else:
            # It brings signal processing, which takes a second to import.
            from excite_cli.diagnosis.measured_prior import measured_stack

            data = load_dataset(terminal, problem.robot, problem.spec, [path])
            stack, words = measured_stack(problem, data)
        terminal.say(f"--prior {path}: {words}")
        found.append((str(path), stack))
    return found


def load_dataset(
    terminal: Terminal, robot: "Robot", spec: "Spec", files: Sequence[Path]
) -> "Dataset":
    """Measured data of `robot`, checked; what was noticed is told.

    Raises
    ------
    FileError
        A file cannot be read, or holds what no diagnosis should be made of.
    """
    from excite_cli.measurement.catalogue import read_dataset
    from excite_cli.measurement.quality import raise_for_errors

    limits = robot.limits
    data = read_dataset(
        files,
        spec.measurement,
        robot.joint_names,
        (limits.lower, limits.upper, limits.velocity, limits.effort),
        (~robot.sliding).astype(float),
    )
    raise_for_errors(data)
    runs = "1 run" if len(data.runs) == 1 else f"{len(data.runs)} runs"
    seconds = sum(run.duration for run in data.runs)
    terminal.say(f"{robot.name}: {robot.n} joints; {runs}, {seconds:.3g} s")
    tell_findings(terminal, data.findings)
    return data


def tell_findings(terminal: Terminal, findings: "Sequence[Finding]") -> None:
    """What was noticed; the same of several runs is told once."""
    runs: dict[tuple[str, str], list[str]] = {}
    for finding in findings:
        runs.setdefault((finding.severity, finding.text), []).append(finding.run or "")
    for (severity, text), names in runs.items():
        listed = ", ".join(name for name in names if name)
        terminal.say(f"{severity}{f' ({listed})' if listed else ''}: {text}")


def output_path(
    output: Path | None,
    config: Path,
    overwrite: bool,
    resume: bool = False,
    inputs: Sequence[Path] = (),
) -> Path:
    """Where the result goes.

    Raises
    ------
    FileError
        It is one of `inputs`, exists already and nothing says to replace or resume it, another run
        is writing it, or it cannot be written.
    """
    path = output or Path(f"{config.stem}.h5")
    if path.is_file() and config.is_file() and path.samefile(config):
        load_spec(config)  # tells that this is no config
    refuse_inputs_as_outputs({"--output": path}, (config, *inputs))
    claim_file(path)
    if path.exists() and not overwrite and not resume:
        raise FileError(
            f"{path} exists already. Give another name with -o, go on with --resume, or replace "
            "it with --overwrite."
        )
    return path
