"""One page from several files: what each kind has to say, and several of a kind side by side."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from excite_cli.config.load_spec import parse_spec
from excite_cli.diagnosis.answer_words import answer_in_words
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.identification.stored_model import StoredFit
from excite_cli.robot.model import Robot
from excite_cli.scoring.records import Score
from excite_cli.shown.answer import KeyFigure, Page, Section, Text
from excite_cli.summary.diagnosis import diagnosis_sections
from excite_cli.summary.identification import fit_figures, fit_in_a_sentence, fit_sections
from excite_cli.summary.pairs import doubts_in_words
from excite_cli.summary.result_page import result_answer, result_figures, result_sections
from excite_cli.summary.score import score_figures, score_sections, sentences
from excite_cli.summary.side_by_side import (
    comparable,
    compare_diagnoses,
    compare_fits,
    compare_results,
)
from excite_cli.summary.status import diagnosis_figures


@dataclass(frozen=True)
class Source:
    """One file of a report.

    `name` tells it from the others on the page, `file` is its file name. A result needs the
    `problem` that it was made for, and may show a `picture` of its robot. `robot`: of a diagnosis,
    to draw its meshes.
    """

    name: str
    file: str
    content: Result | StoredFit | Diagnosis | Score
    problem: Problem | None = None
    picture: bool = True
    robot: Robot | None = None

    @property
    def stage(self) -> int:
        """Motions, then what was identified, diagnosed, and scored."""
        kinds = (Result, StoredFit, Diagnosis, Score)
        return next(k for k, kind in enumerate(kinds) if isinstance(self.content, kind))


@dataclass(frozen=True)
class _Part:
    """What one source says."""

    source: Source
    figures: Sequence[KeyFigure]
    sections: Sequence[Section]
    answers: tuple[Text, ...] = ()
    alone: tuple[Text, ...] = ()  # what it says first where nothing else is on the page


def page_of(sources: Sequence[Source], show: Callable[[str, int], None]) -> Page:
    """The page of `sources`: first what comes last in a loop, so that the answer is on top.

    `show(name, done)` hears what is being drawn.
    """
    parts = []
    for done, source in enumerate(sources):
        show(source.name, done)
        parts.append(_part(source))
    parts.sort(key=lambda part: -part.source.stage)
    sections = [section for part in _distinct(parts) for section in part.sections]
    figures = [figure for part in _distinct(parts) for figure in part.figures]
    compared = _compared(sources)
    stages = {source.stage for source in sources}
    # Files of one kind are there to be compared; results of a loop are there to be read in order.
    results = [source.content for source in sources if isinstance(source.content, Result)]
    first = comparable(results) if len(results) == len(sources) else len(stages) == 1
    return Page(
        _title(sources),
        "Made by excite from " + ", ".join(source.file for source in sources),
        tuple(figures),
        (*compared, *sections) if first else (*sections, *compared),
        tuple(_answers(parts)),
    )


def _part(source: Source) -> _Part:
    content, problem = source.content, source.problem
    if isinstance(content, Result):
        assert problem is not None, "a result is reported with its problem"
        sections = result_sections(content, problem, source.name, source.picture)
        doubts = tuple(
            Text(f"{source.file}: {words}. Its margins here are taken anew, its condition numbers "
                 "are those that the file states. `excite check CONFIG FILE.h5` judges it.", "bad")
            for words in doubts_in_words(content.motions)
        )  # fmt: skip
        alone = () if doubts or not content.motions else (result_answer(content),)
        return _Part(source, result_figures(content, problem), sections, doubts, alone)
    if isinstance(content, StoredFit):
        alone = (Text(fit_in_a_sentence(content), "answer"),)
        return _Part(source, fit_figures(content), fit_sections(content), alone=alone)
    if isinstance(content, Score):
        told = Text(" ".join(sentences(content)), "bad" if content.alarms else "answer")
        return _Part(source, score_figures(content), score_sections(content), (told,))
    answer = Text(answer_in_words(content), "answer" if content.good else "bad")
    sections = diagnosis_sections(content, robot=source.robot)
    return _Part(source, diagnosis_figures(content), sections, (answer,))


def _distinct(parts: Sequence[_Part]) -> list[_Part]:
    """Titles, anchors and names of figures that occur twice say which file they belong to."""
    titles = Counter(section.title for part in parts for section in part.sections)
    anchors = Counter(section.anchor for part in parts for section in part.sections)
    names = Counter(figure.name for part in parts for figure in part.figures)
    first = parts[0].source.stage  # what is behind the answer is not printed
    found = []
    for number, part in enumerate(parts, start=1):
        of = part.source.name
        sections = tuple(
            replace(
                section,
                on_paper=section.on_paper and part.source.stage == first,
                title=f"{section.title}: {of}" if titles[section.title] > 1 else section.title,
                anchor=f"{section.anchor}-{number}"
                if anchors[section.anchor] > 1
                else section.anchor,
            )
            for section in part.sections
        )
        figures = tuple(
            replace(
                figure,
                name=f"{figure.name}, {of}" if names[figure.name] > 1 else figure.name,
                anchor=f"{figure.anchor}-{number}" if anchors[figure.anchor] > 1 else figure.anchor,
            )
            for figure in part.figures
        )
        found.append(replace(part, sections=sections, figures=figures))
    return found


def _answers(parts: Sequence[_Part]) -> Iterator[Text]:
    """What every source says first; several of a kind say of which file."""
    stages = Counter(part.source.stage for part in parts)
    for part in parts:
        for answer in (*part.answers, *(part.alone if len(parts) == 1 else ())):
            several = stages[part.source.stage] > 1 and part.source.problem is None
            of = f"{part.source.name}: " if several else ""
            yield replace(answer, text=of + answer.text)


def _compared(sources: Sequence[Source]) -> tuple[Section, ...]:
    """Sections that put several files of a kind side by side."""
    results = {s.name: s.content for s in sources if isinstance(s.content, Result)}
    fits = {s.name: s.content for s in sources if isinstance(s.content, StoredFit)}
    diagnoses = {s.name: s.content for s in sources if isinstance(s.content, Diagnosis)}
    return (
        *([compare_results(results)] if len(results) > 1 else []),
        *([compare_fits(fits)] if len(fits) > 1 else []),
        *([compare_diagnoses(diagnoses)] if len(diagnoses) > 1 else []),
    )


def _title(sources: Sequence[Source]) -> str:
    names: dict[type, str] = {
        Result: "motions",
        StoredFit: "identified parameters",
        Diagnosis: "diagnosis",
        Score: "score",
    }
    robots = dict.fromkeys(s.problem.robot.name for s in sources if s.problem is not None)
    if not robots:
        configs = (
            source.content.config for source in sources if not isinstance(source.content, Score)
        )
        robots = dict.fromkeys(
            Path(parse_spec(config).robot.urdf.rpartition(":")[2]).stem for config in configs
        )
    kinds = (kind for source in sources for kind in names if isinstance(source.content, kind))
    words = ", ".join(names[kind] for kind in dict.fromkeys(kinds))
    return f"{', '.join(robots)}: {words}" if robots else words.capitalize()
