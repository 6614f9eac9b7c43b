"""`excite report`: one page about motions, fits and diagnoses; figures of motions as files."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT
from excite_cli.cli.report_figures import Format, write_figures

if TYPE_CHECKING:
    from excite_cli.cli.report_files import Told
    from excite_cli.excitation.problem import Problem
    from excite_cli.excitation.result import Result
    from excite_cli.report.page import Picture


def report(
    files: Annotated[
        list[Path],
        typer.Argument(help="Results, fits and diagnoses, in any order.", show_default=False),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The page. Default: <first file>-report.html here.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(
            "--figures",
            metavar="DIR",
            help="Write figures of the motions to this folder, or to NAME.pdf; the page only with "
            "-o.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    kind: Annotated[
        Format | None,
        typer.Option(
            "--format", help="Of --figures in a folder. Default: png.", rich_help_panel=OUTPUT
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="The YAML file it was made with, to find a relative URDF."),
    ] = None,
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Show the robot on the page.")
    ] = True,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Write a page (HTML, one file, no network) about motions, what was identified and diagnosed.

    Condition numbers beside random motions, every joint against its limits, the margins of all
    constraints, parameters, residuals, found effects, errors before and after; several files of
    the same kind are compared. The problem is rebuilt from the config that a result holds; where
    that names a URDF by a relative path, --config says what it starts from.

    Examples:
      excite report ur10.h5 -o ur10.html
      excite report ur10.h5 fit.h5 diagnosis.h5 -o loop.html
      excite report ur10.h5 more.h5 -o compared.html
      excite report ur10.h5 --figures ur10-figures --format svg
    """
    from excite_cli.atomic import write_text_atomically
    from excite_cli.cli.rebuilt import rebuilt_problem
    from excite_cli.cli.report_files import read_files
    from excite_cli.cli.setup import single_threaded
    from excite_cli.errors import FileError
    from excite_cli.excitation.result import Result
    from excite_cli.report.style import matplotlib_part

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    matplotlib_part("")
    if kind is not None and figures is None:
        raise FileError("--format is that of figures: give a folder for them with --figures.")
    page = output or (Path(f"{files[0].stem}-report.html") if figures is None else None)
    if page is not None:
        _check_page(page, overwrite)
    with single_threaded():
        told = read_files(files)
        problems = {
            each.path: rebuilt_problem(each.path, each.content, config)
            for each in told
            if isinstance(each.content, Result)
        }
        written: list[str] = []
        if figures is not None:
            written = write_figures(terminal, told, problems, (figures, kind, overwrite))
        if page is not None:
            text = _page_text(terminal, told, problems, picture)
            write_text_atomically(page, text)
    terminal.answer(
        [*([str(page)] if page is not None else []), *written],
        {"output": None if page is None else str(page), "figures": written},
    )


def _check_page(page: Path, overwrite: bool) -> None:
    """See that the page can be written.

    Raises
    ------
    FileError
        It exists and nothing says to replace it, or its name is that of another format.
    """
    from excite_cli.api.outputs import check_outputs
    from excite_cli.errors import FileError

    if page.suffix.lower() not in (".html", ".htm") and not page.is_dir():
        hint = " Figures and PDF are written by --figures."
        raise FileError(f"-o {page}: a report is a page, NAME.html.{hint}")
    check_outputs({"output": page}, overwrite)


def _page_text(
    terminal: Terminal, told: "Sequence[Told]", problems: "Mapping[Path, Problem]", picture: bool
) -> str:
    from excite_cli.report.assembly import Source, page_of
    from excite_cli.report.page import render

    with terminal.live("drawing", len(told)) as show:
        sources = []
        for each in told:
            problem, taken = problems.get(each.path), None
            if picture and problem is not None:
                show(f"{each.name}: the robot", 0)
                taken = _picture(terminal, each, problem)
            sources.append(Source(each.name, each.path.name, each.content, problem, taken))
        return render(page_of(sources, show))


def _picture(terminal: Terminal, each: "Told", problem: "Problem") -> "Picture | None":
    """The robot where it comes nearest to something in its first motion, if that can be drawn."""
    from typing import cast

    from excite_cli.api.motions import motions_of
    from excite_cli.errors import MissingExtraError
    from excite_cli.report.page import Picture

    try:
        from excite_cli.view.pictures import View, still_png

        result = cast("Result", each.content)
        segment = motions_of(result, [result.motions[0].index], str(each.path))[0]
        png = still_png(problem, segment, View(size=(600, 441), ghosts=3, caption=False))
    except (MissingExtraError, ImportError) as error:
        terminal.detail(f"no picture of the robot: {error}")
        return None
    name = problem.robot.name
    return Picture(
        f"{name} in its first motion",
        png,
        f"{name} at the instant of its first motion at which it comes nearest to itself or to "
        "something around it, with three other instants faintly behind.",
        f"Where it comes nearest to something. `excite view {each.path.name}` plays all motions.",
    )
