"""The page of an inspection: what of log and model is fine, doubtful or wrong, and its cure."""

from excite_cli.checks.sentences import written
from excite_cli.report.page import KeyFigure, Page, Section, Table, Text
from excite_cli.report.score_sections import table_of
from excite_cli.summary.inspection import Inspected, checks_table, counted, headline, remarks


def inspection_page(found: Inspected, title: str) -> Page:
    """The table of all checks, the evidence of what is not fine, and what would be set."""
    faults, doubts, _ = counted(found)
    sections = [Section("checks", "Checks", (table_of(checks_table(found)),))]
    if texts := remarks(found):
        sections.append(Section("evidence", "Evidence", tuple(map(Text, texts))))
    if found.settings:
        rows = tuple((key, written({key: value})) for key, value in found.settings.items())
        cures = Table(("key", "line that inspect --apply writes"), rows, wordy=frozenset({1}))
        sections.append(Section("settings", "What would change in the config", (cures,)))
    return Page(
        title,
        "Log and model, before any physics",
        (KeyFigure("faults", str(faults)), KeyFigure("doubts", str(doubts))),
        tuple(sections),
        (Text(headline(found), "good" if found.good else "bad"),),
    )
