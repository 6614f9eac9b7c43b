"""From command-line arguments to a problem, priors and data."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from excite_cli.api import loading
from excite_cli.api.outputs import claim_file
from excite_cli.api.threads import single_threaded as single_threaded
from excite_cli.cli.console import Terminal
from excite_cli.config.load import load_spec
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem
from excite_cli.store.fit_knowledge import fit_knowledge

if TYPE_CHECKING:
    from excite_cli.diagnosis.next_motion import NextMotion
    from excite_cli.excitation.result import Result
    from excite_cli.excitation.stack import Stack


def load_problem(
    terminal: Terminal, config: Path, overrides: list[str] | None, extra: list[str] | None = None
) -> Problem:
    """Load, override, build; tell what was understood."""
    return loading.load_problem(config, [*(overrides or []), *(extra or [])], terminal.tell)


def load_next_motion(
    terminal: Terminal, config: Path, after: Path, changes: list[str]
) -> "NextMotion":
    """The problem of `config` after the diagnosis `after`; tell what is planned and why."""
    from excite_cli.diagnosis.next_motion import plan_after
    from excite_cli.store.diagnosis_file import read_diagnosis
    from excite_cli.summary.problem import problem_notes

    spec, folder = load_spec(config, changes), config.resolve().parent
    found = plan_after(read_diagnosis(after), spec, folder, fit_knowledge(spec, folder))
    for note in problem_notes(found.model):
        terminal.tell(note)
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
    from excite_cli.api.motions import is_motion, load_motions
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
            motion = load_motions(problem, path, tell=terminal.tell)[0]
            stack, words = planned_stack(problem, motion)
        else:
            # It brings signal processing, which takes a second to import.
            from excite_cli.diagnosis.measured_prior import measured_stack

            data = loading.load_data(problem, path, terminal.tell)
            stack, words = measured_stack(problem, data)
        terminal.say(f"--prior {path}: {words}")
        found.append((str(path), stack))
    return found


def output_path(output: Path | None, config: Path, overwrite: bool, resume: bool = False) -> Path:
    """Where the result goes.

    Raises
    ------
    FileError
        It exists already and nothing says to replace or resume it, another run is writing it, or
        it cannot be written.
    """
    path = output or Path(f"{config.stem}.h5")
    if path.is_file() and config.is_file() and path.samefile(config):
        load_spec(config)  # tells that this is no config
    claim_file(path)
    if path.exists() and not overwrite and not resume:
        raise FileError(
            f"{path} exists already. Give another name with -o, go on with --resume, or replace "
            "it with --overwrite."
        )
    return path
