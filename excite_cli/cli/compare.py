"""`excite compare`: what changed between days."""

from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step
from excite_cli.errors import ConfigError


@options.command
def compare(
    terminal: Terminal,
    files: list[Path] = typer.Argument(
        ...,
        metavar="OLD NEW…",
        help="Fits, diagnoses or scores of one robot, in order of time.",
        show_default=False,
    ),
    covariate: list[str] | None = typer.Option(
        None,
        "--covariate",
        metavar="NAME=V,V,…",
        help="Regress out this covariate, with a value per file; columns of logs are known.",
    ),
    output: Path | None = options.written(
        "--output",
        "-o",
        metavar="NAME.html",
        help="A page with the friction of every joint over the days.",
    ),
    overwrite: options.Overwrite = False,
) -> None:
    """Report which parameters and effects changed over time, each with its test.

    Every parameter is tested for the data set from which on its value differs. The part that
    temperature or another column of the log explains is regressed out first, where there are enough
    of them. The p-values are corrected for the number of parameters and data sets. In a score,
    every run is one; of fits and diagnoses, give two or more: january.h5 february.h5 march.h5.

    Examples:
      excite compare week.h5 -o week.html
    """
    from excite_cli.api.changes import changes_answer
    from excite_cli.api.changes import compare as compare_files

    found = compare_files(
        files, dict(map(_column, covariate or ())), output=output, overwrite=overwrite
    )
    words = "find out what changed in the robot" if found.significant else ""
    following = next_step(words, "diagnose", "CONFIG.yaml", "NEWEST.h5") if words else ()
    terminal.show(changes_answer(found, output), following)


def _column(text: str) -> tuple[str, list[float]]:
    """A name and its numbers."""
    name, _, values = text.partition("=")
    try:
        numbers = [float(each) for each in values.split(",")]
    except ValueError:
        numbers = []
    if not (name and numbers):
        raise ConfigError(f"--covariate {text}: give a name and numbers, as temp=21.5,24,30.")
    return name, numbers
