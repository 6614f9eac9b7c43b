"""One page from several files: what each kind has to say, and several of a kind side by side."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from excite_cli.checks.sentences import written
from excite_cli.diagnosis.answer_words import answer_in_words
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.campaign import RebuiltResult
from excite_cli.report.compare_section import (
    comparable,
    compare_diagnoses,
    compare_fits,
    compare_results,
)
from excite_cli.report.condition_section import condition_figures, condition_section
from excite_cli.report.config_section import config_section
from excite_cli.report.diagnosis_sections import diagnosis_figures, diagnosis_sections
from excite_cli.report.fit_sections import fit_figures, fit_sections
from excite_cli.report.margin_section import margin_figures, margin_section
from excite_cli.report.motion_section import motion_section
from excite_cli.report.page import KeyFigure, Page, PageSection, TableBlock, Text
from excite_cli.report.score_sections import score_figures, score_sections, table_of
from excite_cli.report.weakest_section import weakest_section
from excite_cli.scoring.records import Score
from excite_cli.summary.inspection import AnyInspection, checks_table, counted, headline, remarks
from excite_cli.summary.pairs import doubts_in_words
from excite_cli.summary.score import sentences

# The page of an inspection: what of log and model is fine, doubtful or wrong, and its cure.


def inspection_page(found: AnyInspection, title: str) -> Page:
    """The table of all checks, the evidence of what is not fine, and what would be set."""
    faults, doubts, _ = counted(found)
    sections = [PageSection("checks", "Checks", (table_of(checks_table(found)),))]
    if texts := remarks(found):
        sections.append(PageSection("evidence", "Evidence", tuple(map(Text, texts))))
    if found.settings:
        rows = tuple((key, written({key: value})) for key, value in found.settings.items())
        cures = TableBlock(("key", "line that inspect --apply writes"), rows, wordy=frozenset({1}))
        sections.append(PageSection("settings", "What would change in the config", (cures,)))
    return Page(
        title,
        "Log and model: set-up checks",
        (KeyFigure("faults", str(faults)), KeyFigure("doubts", str(doubts))),
        tuple(sections),
        (Text(headline(found), "good" if found.good else "bad"),),
    )


# All that a page says about one result file, in reading order.


def campaign_figures(campaign: RebuiltResult) -> tuple[KeyFigure, ...]:
    """What sums it up."""
    return (*condition_figures(campaign), *margin_figures(campaign))


def campaign_sections(campaign: RebuiltResult, picture: bool = True) -> tuple[PageSection, ...]:
    """Condition numbers, what shows least, motions, margins, how it was made."""
    return (
        condition_section(campaign, picture),
        motion_section(campaign),
        margin_section(campaign),
        weakest_section(campaign),
        config_section(campaign),
    )


@dataclass(frozen=True)
class Source:
    """One file of a report.

    `name` tells it from the others on the page, `file` is its file name. A result needs the
    `problem` that it was made for, and may show a `picture` of its robot.
    """

    name: str
    file: str
    content: Result | StoredFit | Diagnosis | Score
    problem: Problem | None = None
    picture: bool = True


@dataclass(frozen=True)
class _Part:
    """What one source says."""

    source: Source
    figures: tuple[KeyFigure, ...]
    sections: tuple[PageSection, ...]
    answers: tuple[Text, ...] = ()


def page_of(sources: Sequence[Source], show: Callable[[str, int], None]) -> Page:
    """The page of `sources`, in their order; `show(name, done)` hears what is being drawn."""
    campaigns = _campaigns(sources)
    parts = []
    for done, source in enumerate(sources):
        show(source.name, done)
        parts.append(_part(source, campaigns.get(source.name)))
    sections = [section for part in _distinct(parts) for section in part.sections]
    figures = [figure for part in _distinct(parts) for figure in part.figures]
    compared = _compared(sources, campaigns)
    # Runs of one problem are there to be compared; files of a loop are there to be read in order.
    first = len(campaigns) == len(sources) and comparable(list(campaigns.values()))
    return Page(
        _title(sources),
        "Made by excite from " + ", ".join(source.file for source in sources),
        tuple(figures),
        (*compared, *sections) if first else (*sections, *compared),
        tuple(answer for part in parts for answer in part.answers),
    )


def _campaigns(sources: Sequence[Source]) -> dict[str, RebuiltResult]:
    found: dict[str, RebuiltResult] = {}
    count = sum(isinstance(source.content, Result) for source in sources)
    for source in sources:
        if isinstance(source.content, Result):
            assert source.problem is not None, "a result is reported with its problem"
            number, alone = len(found) + 1, count == 1
            campaign = RebuiltResult(source.name, source.content, source.problem, number, alone)
            found[source.name] = campaign
    return found


def _part(source: Source, campaign: RebuiltResult | None) -> _Part:
    content = source.content
    if campaign is not None:
        sections = campaign_sections(campaign, source.picture)
        doubts = tuple(
            Text(f"{source.file}: {words}. Its margins here are taken anew, its condition numbers "
                 "are those that the file states. `excite check CONFIG FILE.h5` judges it.", "bad")
            for words in doubts_in_words(campaign.result.motions)
        )  # fmt: skip
        return _Part(source, campaign_figures(campaign), sections, doubts)
    if isinstance(content, StoredFit):
        return _Part(source, fit_figures(content), fit_sections(content))
    if isinstance(content, Score):
        told = Text(" ".join(sentences(content)), "bad" if content.alarms else "answer")
        return _Part(source, score_figures(content), score_sections(content), (told,))
    assert isinstance(content, Diagnosis)
    answer = Text(answer_in_words(content), "answer" if content.good else "bad")
    return _Part(source, diagnosis_figures(content), diagnosis_sections(content), (answer,))


def _distinct(parts: Sequence[_Part]) -> list[_Part]:
    """Titles, anchors and names of figures that occur twice say which file they belong to."""
    titles = Counter(section.title for part in parts for section in part.sections)
    anchors = Counter(section.anchor for part in parts for section in part.sections)
    names = Counter(figure.name for part in parts for figure in part.figures)
    found = []
    for number, part in enumerate(parts, start=1):
        of = part.source.name
        sections = tuple(
            replace(
                section,
                title=f"{section.title}: {of}" if titles[section.title] > 1 else section.title,
                anchor=f"{section.anchor}-{number}"
                if anchors[section.anchor] > 1
                else section.anchor,
            )
            for section in part.sections
        )
        figures = tuple(
            replace(figure, name=f"{figure.name}, {of}") if names[figure.name] > 1 else figure
            for figure in part.figures
        )
        found.append(replace(part, sections=sections, figures=figures))
    return found


def _compared(
    sources: Sequence[Source], campaigns: dict[str, RebuiltResult]
) -> tuple[PageSection, ...]:
    """Sections that put several files of a kind side by side."""
    fits = {s.name: s.content for s in sources if isinstance(s.content, StoredFit)}
    diagnoses = {s.name: s.content for s in sources if isinstance(s.content, Diagnosis)}
    sections: list[PageSection] = []
    if len(campaigns) > 1:
        sections.append(compare_results(list(campaigns.values())))
    if len(fits) > 1:
        sections.append(compare_fits(fits))
    if len(diagnoses) > 1:
        sections.append(compare_diagnoses(diagnoses))
    return tuple(sections)


def _title(sources: Sequence[Source]) -> str:
    kinds: dict[type, str] = {
        Result: "motions",
        StoredFit: "identified parameters",
        Diagnosis: "diagnosis",
        Score: "score",
    }
    robots = dict.fromkeys(s.problem.robot.name for s in sources if s.problem is not None)
    words = ", ".join(dict.fromkeys(kinds[type(source.content)] for source in sources))
    return f"{', '.join(robots)}: {words}" if robots else words.capitalize()
