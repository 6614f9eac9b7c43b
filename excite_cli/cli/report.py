"""`excite report`: one page about motions, fits and diagnoses; figures of them as files."""

from enum import StrEnum
from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step


class Format(StrEnum):
    """What a figure is written as."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


@options.command
def report(
    terminal: Terminal,
    files: list[Path] = typer.Argument(
        ..., help="Results, fits and diagnoses, in any order.", show_default=False
    ),
    output: Path | None = options.written(
        "--output", "-o", help="The page. Default: <first file>-report.html here."
    ),
    figures: Path | None = options.written(
        "--figures",
        metavar="DIR",
        help="Write figures of motions and diagnoses to this folder, or to NAME.pdf; the "
        "page only with -o.",
    ),
    kind: Format | None = options.written(
        "--format", help="Format of --figures in a folder. Default: png."
    ),
    config: Path | None = typer.Option(
        None, "--config", help="The YAML file it was made with: a URDF is relative to it."
    ),
    picture: bool = typer.Option(
        True, "--picture/--no-picture", help="Show the robot on the page."
    ),
    overwrite: options.Overwrite = False,
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
      excite report ur10.h5 diagnosis.h5 --figures ur10-figures --format svg
    """
    from excite_cli.api.reporting import report_answer, write_report

    with terminal.live("drawing") as line:
        found = write_report(
            files,
            output,
            figures=figures,
            format=kind,
            config=config,
            picture=picture,
            overwrite=overwrite,
            progress=line,
        )
    following = next_step(f"open {found.page} in a browser") if found.page else ()
    terminal.show(report_answer(found), following)
