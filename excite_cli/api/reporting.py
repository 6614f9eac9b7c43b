"""One page about motions, fits and diagnoses, and figures: `excite report`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.loading import rebuilt_problem, with_own_margins
from excite_cli.api.outputs import held
from excite_cli.api.paths import page_path, paths_in
from excite_cli.api.report_figures import ReportedFile, read_files, write_figures
from excite_cli.atomic import write_text_atomically
from excite_cli.errors import ConfigError, FileError
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.report.page import render
from excite_cli.report.style import matplotlib_part
from excite_cli.shown.answer import Answer
from excite_cli.summary.assembly import Source, page_of
from excite_cli.summary.pairs import doubts_in_words

FIGURE_FORMATS = ("png", "svg", "pdf")
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Report:
    """The files that were written: the page, if one was requested, and figures.

    `doubts`: which motions of which file do not count as proved, and why.
    """

    page: Path | None
    figures: tuple[Path, ...] = ()
    doubts: tuple[str, ...] = ()


@checked()
def write_report(
    files: str | Path | Sequence[str | Path],
    output: str | Path | None = None,
    *,
    figures: str | Path | None = None,
    format: str | None = None,
    config: str | Path | None = None,
    picture: bool = True,
    overwrite: bool = False,
    progress: Progress = lambda text, done, total: None,
) -> Report:
    """A page (HTML, one file) about motions, what was identified and diagnosed: `excite report`.

    `files` are results, fits and diagnoses, in any order. The page is `output`, by default
    `<first file>-report.html` in the working directory; with `figures` (a folder, or NAME.pdf) the
    figures of motions and diagnoses are written there, in `format` (`png` | `svg` | `pdf`), and the
    page only to an `output` that is given. The problem of a result is rebuilt from the config that
    it holds; `config`, the YAML file, says where a relative URDF starts from. With `picture` the
    page shows the robot.

    Returns
    -------
    Report
        The files that were written.

    Raises
    ------
    FileError
        A file is missing, given twice or none of ours; the robot is not found, or not the one of
        the result; `output` is no name of a page, or a file exists already.
    ConfigError, MissingExtraError
        There is no such format of figures; matplotlib is not installed.
    """
    if figures is not None:
        matplotlib_part("")
    if format is not None and format not in FIGURE_FORMATS:
        raise ConfigError(f"--format {format}: unknown. Known: {', '.join(FIGURE_FORMATS)}.")
    if format is not None and figures is None:
        raise FileError("--format is that of figures: give a folder for them with --figures.")
    paths = [Path(files)] if isinstance(files, str | Path) else [Path(each) for each in files]
    if not paths:
        raise FileError("There is nothing to report: give results, fits or diagnoses.")
    page = Path(output) if output is not None else None
    if page is None and figures is None:
        page = Path(f"{paths[0].stem}-report.html")
    if page is not None:
        page = page_path(page, " Figures and PDF are written by --figures.")
    with held({"output": page}, overwrite, paths_in(paths, config)):
        told = read_files(paths)
        problems = {
            each.path: rebuilt_problem(each.content, config, str(each.path))
            for each in told
            if isinstance(each.content, Result)
        }
        told = tuple(_with_own_margins(each, problems) for each in told)
        drawn: tuple[Path, ...] = ()
        if figures is not None:
            drawn = write_figures(told, problems, (Path(figures), format, overwrite), progress)
        if page is not None:
            write_text_atomically(page, _page_text(told, problems, picture, progress))
    doubts = (
        f"{each.path}: {words}"
        for each in told
        if isinstance(each.content, Result)
        for words in doubts_in_words(each.content.motions)
    )
    return Report(page, drawn, tuple(doubts))


def _with_own_margins(file: ReportedFile, problems: Mapping[Path, Problem]) -> ReportedFile:
    """The file, with margins taken anew of motions that its own may not be of."""
    if not isinstance(file.content, Result):
        return file
    return replace(file, content=with_own_margins(file.content, problems[file.path]))


def report_answer(found: Report) -> Answer:
    """What `excite report` answers: what is in doubt, and the files."""
    figures = tuple(map(str, found.figures))
    page = None if found.page is None else str(found.page)
    doubts = tuple(f"{words}." for words in found.doubts)
    parts = (*doubts, *figures) if page is None else (*doubts, page, *figures)
    data = {"output": page, "figures": list(figures), "doubts": list(found.doubts)}
    return Answer(parts, data)


def _page_text(
    told: Sequence[ReportedFile],
    problems: Mapping[Path, Problem],
    picture: bool,
    progress: Progress,
) -> str:
    sources = [
        Source(each.name, each.path.name, each.content, problems.get(each.path), picture)
        for each in told
    ]
    return render(page_of(sources, lambda name, done: progress(name, done, len(told))))
