"""Figures of motions and diagnoses as files: PNG, SVG or PDF in a folder, or one PDF."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from excite_cli.api.outputs import held
from excite_cli.api.report_files import Told
from excite_cli.atomic import write_atomically
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import FileError
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.report.condition_figure import draw_condition_numbers, draw_spectrum
from excite_cli.report.diagnosis_figures import figures_of
from excite_cli.report.motion_figure import draw_margins, draw_motion, watched_constraints
from excite_cli.report.style import save_figure, save_pages

Progress = Callable[[str, int, int], None]


def write_figures(
    told: Sequence[Told],
    problems: Mapping[Path, Problem],
    asked: tuple[Path, str | None, bool],
    progress: Progress,
) -> tuple[Path, ...]:
    """Write the figures of all results and diagnoses to a folder or a PDF; returns the paths.

    `asked`: where, the format (default: png), and whether files are replaced.

    Raises
    ------
    FileError
        There is nothing to draw, the place does not suit the format, or something is there already.
    """
    target, kind, overwrite = asked
    figures: dict[str, Callable[[], Any]] = {}
    kinds = Counter(type(each.content) for each in told)
    for each in told:
        own: dict[str, Callable[[], Any]] = {}
        if isinstance(each.content, Result):
            own = _figures(each.content, problems[each.path])
        elif isinstance(each.content, Diagnosis):
            own = figures_of(each.content)
        prefix = f"{each.path.stem}_" if kinds[type(each.content)] > 1 else ""
        figures |= {f"{prefix}{name}": draw for name, draw in own.items()}
    if not figures:
        raise FileError(
            "--figures draws motions and diagnoses, and none was given. Leave it out, or give a "
            "result or a diagnosis."
        )
    paths = _paths(target, kind, list(figures))

    def drawn() -> Iterator[Any]:
        for done, (name, draw) in enumerate(figures.items()):
            progress(name, done, len(figures))
            yield draw()

    refuse_inputs_as_outputs({f"--figures ({p})": p for p in paths}, [each.path for each in told])
    with held({str(path): path for path in paths}, overwrite=True):
        if not overwrite:
            _refuse_present(paths)
        if _is_single(target):
            write_atomically(target, lambda temporary: save_pages(drawn(), temporary))
        else:
            for path, figure in zip(paths, drawn(), strict=True):
                suffix = path.suffix.removeprefix(".")
                write_atomically(path, partial(save_figure, figure, kind=suffix))
    return tuple(paths)


def _is_single(target: Path) -> bool:
    """Whether all figures go into one file."""
    return target.suffix.lower() == ".pdf" and not target.is_dir()


def _paths(target: Path, kind: str | None, names: list[str]) -> list[Path]:
    """The files that will be written.

    Raises
    ------
    FileError
        `target` does not suit the format.
    """
    if target.suffix.lower() in (".png", ".svg") and not target.is_dir():
        raise FileError(
            f"--figures {target}: there are {len(names)} figures and {target.suffix} holds one. "
            f"Give a folder (and --format {target.suffix[1:].lower()}), or a name that ends in "
            ".pdf."
        )
    if _is_single(target):
        if kind not in (None, "pdf"):
            raise FileError(f"--figures {target} asks for a PDF and --format for {kind}. Drop one.")
        paths = [target]
    elif target.exists() and not target.is_dir():
        raise FileError(
            f"--figures {target} is a file. Give a folder, or a name that ends in .pdf."
        )
    else:
        paths = [target / f"{name}.{kind or 'png'}" for name in names]
    return paths


def _refuse_present(paths: list[Path]) -> None:
    present = [path for path in paths if path.exists()]
    if present:
        raise FileError(
            f"{present[0]} exists already. Give another place with --figures, or replace it with "
            "--overwrite."
        )


def _figures(result: Result, problem: Problem) -> dict[str, Callable[[], Any]]:
    """What draws each figure, by its name, in reading order."""
    figures: dict[str, Callable[[], Any]] = {
        "condition_numbers": partial(draw_condition_numbers, result),
        "spectrum": partial(draw_spectrum, result, problem),
    }
    for motion in result.motions:
        figures[f"motion_{motion.index}"] = partial(draw_motion, motion, problem)
        if watched_constraints(problem):
            figures[f"margins_{motion.index}"] = partial(draw_margins, motion, problem)
    return figures
