"""One page about motions, fits and diagnoses, and figures: `excite report`."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from excite_cli.api.arguments import checked, page_path, paths_in, refuse_twice
from excite_cli.api.loading import rebuilt_problem, with_own_margins
from excite_cli.api.outputs import held
from excite_cli.atomic import write_atomically, write_text_atomically
from excite_cli.config.load_spec import parse_spec
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.errors import ConfigError, ExciteError, FileError
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.given_files import refuse_inputs_as_outputs
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.page import render
from excite_cli.report.plot_figure import matplotlib_part, save_figure, save_pages
from excite_cli.robot.model import Robot, build_measured_robot
from excite_cli.scoring.records import Score
from excite_cli.shown.answer import Answer
from excite_cli.shown.note import unheard
from excite_cli.store.diagnosis_file import is_diagnosis, read_diagnosis
from excite_cli.store.fit_file import is_fit, read_fit
from excite_cli.store.own_file import PROGRAM
from excite_cli.store.result_file import read_result
from excite_cli.store.score_file import is_score, read_score
from excite_cli.summary.assembly import Source, page_of
from excite_cli.summary.figures import diagnosis_figures, result_figures
from excite_cli.summary.pairs import doubts_in_words

FIGURE_FORMATS = ("png", "svg", "pdf")
Progress = Callable[[str, int, int], None]

# Figures of motions and diagnoses as files: PNG, SVG or PDF in a folder, or one PDF.

# Files of any kind for one report: told apart by what they hold, in the order of the loop.


@dataclass(frozen=True)
class ReportedFile:
    """One file: its name on the page, and what it holds."""

    path: Path
    name: str
    content: Result | StoredFit | Diagnosis | Score

    @property
    def earlier(self) -> frozenset[str]:
        """Names of the files that it was made on top of."""
        priors = self.content.priors if isinstance(self.content, Result) else ()
        return frozenset(Path(prior).name for prior in priors)

    @property
    def stage(self) -> int:
        """Motions come first, then what was identified, diagnosed, and scored."""
        return (Result, StoredFit, Diagnosis, Score).index(type(self.content))


def read_files(paths: Sequence[Path]) -> tuple[ReportedFile, ...]:
    """Everything that `paths` hold, motions before fits before diagnoses before what follows them.

    Raises
    ------
    FileError
        A file is missing, given twice, damaged, or of another kind.
    """
    refuse_twice(paths)
    stems = [path.stem for path in paths]
    names = [
        path.stem if stems.count(path.stem) == 1 else str(path.with_suffix("")) for path in paths
    ]
    found = [ReportedFile(path, name, _read(path)) for path, name in zip(paths, names, strict=True)]
    return in_order(found)


def _read(path: Path) -> Result | StoredFit | Diagnosis | Score:
    if path.is_dir():
        raise FileError(f"{path} is a folder. Give files: result, fit or diagnosis (.h5).")
    if is_fit(path):
        return read_fit(path)
    if is_diagnosis(path):
        return read_diagnosis(path)
    if is_score(path):
        return read_score(path)
    try:
        return read_result(path)
    except FileError as error:
        raise FileError(
            f"{error} A report is made of results (`{PROGRAM} optimize`, `{PROGRAM} "
            f"compare-random`), fits (`{PROGRAM} identify`), diagnoses (`{PROGRAM} diagnose`) and "
            f"scores (`{PROGRAM} score`)."
        ) from error


def in_order(files: Sequence[ReportedFile]) -> tuple[ReportedFile, ...]:
    """By stage, but nothing before the files it was made on top of."""
    left, placed = sorted(files, key=lambda each: each.stage), list[ReportedFile]()
    while left:
        waiting = {each.path.name for each in left}
        ready = [each for each in left if not each.earlier & (waiting - {each.path.name})]
        chosen = (ready or left)[0]
        placed.append(chosen)
        left.remove(chosen)
    return tuple(placed)


def write_figures(
    told: Sequence[ReportedFile],
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
            own = result_figures(each.content, problems[each.path])
        elif isinstance(each.content, Diagnosis):
            own = diagnosis_figures(each.content)
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
    progress: Progress = unheard,
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
            write_text_atomically(page, _page_text(told, problems, config, picture, progress))
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


def _robot(file: ReportedFile, config: str | Path | None) -> Robot | None:
    """The robot of a diagnosis, where its URDF is still there and the same."""
    found = file.content
    if not isinstance(found, Diagnosis):
        return None
    folder = Path(found.config_folder) if config is None else Path(config).resolve().parent
    try:
        robot = build_measured_robot(parse_spec(found.config).robot, folder)
    except ExciteError:
        return None
    return robot if robot.fingerprint() == found.fingerprint else None


def _page_text(
    told: Sequence[ReportedFile],
    problems: Mapping[Path, Problem],
    config: str | Path | None,
    picture: bool,
    progress: Progress,
) -> str:
    robots = [_robot(each, config) if picture else None for each in told]
    sources = [
        Source(each.name, each.path.name, each.content, problems.get(each.path), picture, robot)
        for each, robot in zip(told, robots, strict=True)
    ]
    return render(page_of(sources, lambda name, done: progress(name, done, len(told))))
