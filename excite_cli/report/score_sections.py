"""What a page says about a stored model on new data: ratios over the runs, alarms, joints."""

import numpy as np

from excite_cli.report.chart import Colour
from excite_cli.report.page import Charts, KeyFigure, PageSection, TableBlock
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.scoring.records import Score
from excite_cli.shown.answer import Table as ShownTable
from excite_cli.summary.score import joints_table, runs_table

_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "purple", "ink", "muted")


def score_figures(score: Score) -> tuple[KeyFigure, ...]:
    """What sums a score up."""
    made = "" if score.made is None else f"{score.made.mean_relative_moving:.2%} when it was made"
    return (
        KeyFigure("error on these runs, moving", f"{score.error.mean_relative_moving:.2%}", made),
        KeyFigure(
            "runs beyond the model's tolerance",
            f"{len(score.alarms)} of {len(score.runs)}",
            "tolerance: residual of the model on its own data, in proportion to the torque",
        ),
    )


def score_sections(score: Score) -> tuple[PageSection, ...]:
    """Ratios over the runs, the runs with their reasons, and the joints."""
    sections = [
        PageSection("runs", "Runs", (table_of(runs_table(score)),)),
        PageSection("joints", "Joints", (table_of(joints_table(score)),)),
    ]
    if score.made is not None and len(score.runs) > 1:
        sections.insert(
            0, PageSection("ratios", "Residual over the runs", (Charts((_plot(score),)),))
        )
    return tuple(sections)


def _plot(score: Score) -> Plot:
    count = len(score.runs)
    series = tuple(
        Curve(
            joint,
            np.array([run.ratio.get(joint, np.nan) for run in score.runs]),
            _COLOURS[k % len(_COLOURS)],
            "joined",
        )
        for k, joint in enumerate(score.joint_names)
    )
    alarms = ", ".join(run.name for run in score.alarms) or "none"
    return Plot(
        "RMS of the residual over the model's tolerance",
        f"Ratio of every joint over {count} runs; alarms: {alarms}.",
        "run",
        np.arange(1.0, count + 1.0),
        (Panel("ratio", series, height=240),),
        caption="1: as on the day the model was made. Runs are numbered as in the table.",
        wide=True,
        counted=True,
    )


def table_of(shown: ShownTable) -> TableBlock:
    """A table of the terminal, on the page."""
    places = {name: k for k, name in enumerate(shown.columns)}
    told = {places[name] for name in (*shown.left, *shown.words)}
    return TableBlock(
        shown.columns,
        shown.rows,
        shown.title,
        right=frozenset(set(places.values()) - told),
        strong=frozenset(shown.bold),
        wordy=frozenset(places[name] for name in shown.words),
    )
