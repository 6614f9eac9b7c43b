"""`excite report`: figures of a result file."""

from collections.abc import Callable, Iterator
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal

if TYPE_CHECKING:
    from excite_cli.excitation.problem import Problem
    from excite_cli.excitation.result import Result


class Format(StrEnum):
    """What a figure is written as."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


def report(
    file: options.ResultFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder of the figures, or NAME.pdf for one file. Default: <file name>-report.",
        ),
    ] = None,
    kind: Annotated[
        Format | None, typer.Option("--format", help="Format in a folder. Default: png.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="The YAML file it was made with, to find a relative URDF."),
    ] = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Draw a result file: condition numbers, spectrum, and every motion against its limits.

    Figures go to a folder, or as pages into one PDF. The problem is rebuilt from the config that
    the file holds; where that names a URDF by a relative path, --config says what it starts from.

    Example:  excite report talos_arms.h5 -o figures --format svg
    """
    from excite_cli.atomic import write_atomically
    from excite_cli.cli.setup import single_threaded
    from excite_cli.report.style import matplotlib_part, save_figure, save_pages
    from excite_cli.store.result_file import read_result

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    matplotlib_part("")
    target = output or Path(f"{file.stem}-report")
    with single_threaded():
        result = read_result(file)
        problem = _rebuilt(file, result, config)
        figures = _figures(result, problem)
        paths = _paths(target, kind, list(figures), overwrite)
        with terminal.live("drawing", len(figures)) as show:

            def drawn() -> Iterator[Any]:
                for done, (name, draw) in enumerate(figures.items()):
                    show(name, done)
                    yield draw()

            if _is_single(target):
                write_atomically(target, lambda temporary: save_pages(drawn(), temporary))
            else:
                for path, figure in zip(paths, drawn(), strict=True):
                    kind_of = path.suffix.removeprefix(".")
                    write_atomically(path, partial(save_figure, figure, kind=kind_of))
    written = [str(path) for path in paths]
    terminal.answer(written, {"figures": written})


def _is_single(target: Path) -> bool:
    """Whether all figures go into one file."""
    return target.suffix.lower() == ".pdf" and not target.is_dir()


def _paths(target: Path, kind: Format | None, names: list[str], overwrite: bool) -> list[Path]:
    """The files that will be written.

    Raises
    ------
    FileError
        One exists and nothing says to replace it, or `target` does not suit the format.
    """
    from excite_cli.errors import FileError

    if target.suffix.lower() in (".png", ".svg") and not target.is_dir():
        raise FileError(
            f"-o {target}: there are {len(names)} figures and {target.suffix} holds one. Give a "
            f"folder (and --format {target.suffix[1:].lower()}), or a name that ends in .pdf."
        )
    if _is_single(target):
        if kind not in (None, Format.pdf):
            raise FileError(f"-o {target} asks for a PDF and --format for {kind}. Drop one.")
        paths = [target]
    elif target.exists() and not target.is_dir():
        raise FileError(f"-o {target} is a file. Give a folder, or a name that ends in .pdf.")
    else:
        paths = [target / f"{name}.{kind or Format.png}" for name in names]
    present = [path for path in paths if path.exists()]
    if present and not overwrite:
        raise FileError(
            f"{present[0]} exists already. Give another place with -o, or replace it with "
            "--overwrite."
        )
    return paths


def _figures(result: "Result", problem: "Problem") -> dict[str, Callable[[], Any]]:
    """What draws each figure, by its name, in reading order."""
    from excite_cli.report.condition_figure import draw_condition_numbers, draw_spectrum
    from excite_cli.report.motion_figure import draw_margins, draw_motion, watched_constraints

    figures: dict[str, Callable[[], Any]] = {
        "condition_numbers": partial(draw_condition_numbers, result),
        "spectrum": partial(draw_spectrum, result, problem),
    }
    for motion in result.motions:
        figures[f"motion_{motion.index}"] = partial(draw_motion, motion, problem)
        if watched_constraints(problem):
            figures[f"margins_{motion.index}"] = partial(draw_margins, motion, problem)
    return figures


def _rebuilt(file: Path, result: "Result", config: Path | None) -> "Problem":
    """The problem that `file` was made for.

    Raises
    ------
    FileError
        The file holds no motion, its URDF is not found, or the robot is not the one it had.
    """
    from excite_cli.cli.setup import fit_knowledge
    from excite_cli.config.load import load_spec, parse_spec
    from excite_cli.errors import FileError
    from excite_cli.excitation.problem import build_problem
    from excite_cli.excitation.result import matches
    from excite_cli.robot.description import EXAMPLE_PREFIX

    if not result.motions:
        raise FileError(f"{file} holds no motion yet. Go on with `excite optimize --resume`.")
    spec = parse_spec(result.config, f"the config stored in {file}")
    folder = config.resolve().parent if config is not None else Path(result.config_folder)
    if config is not None:
        given = load_spec(config).robot
        found = {"urdf": given.urdf, "package_dirs": given.package_dirs}
        spec = spec.model_copy(update={"robot": spec.robot.model_copy(update=found)})
    urdf = spec.robot.urdf
    if not urdf.startswith(EXAMPLE_PREFIX) and not (folder / urdf).is_file():
        raise FileError(
            f"{file} was made with the URDF {urdf}, and there is none at "
            f"{(folder / urdf).resolve()}. Relative paths start from the config: give the YAML "
            "file it was made with, --config CONFIG.yaml."
        )
    problem = build_problem(spec, folder, fit_knowledge(spec, folder))
    reason = matches(problem, result)
    if reason:
        raise FileError(
            f"{file} does not fit the robot that was found ({urdf}): {reason}. Give the YAML file "
            "it was made with, --config CONFIG.yaml, and the URDF as it was."
        )
    return problem
