"""What a page says about the days of a robot: every quantity of its joints over them, as a chart.

Friction comes first; a point has a whisker of two standard deviations to each side.
"""

import numpy as np

from excite_cli.report.chart import Colour, limits_about
from excite_cli.report.page import Charts, KeyFigure, Page, PageSection
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.report.score_sections import table_of
from excite_cli.robot.model import Array
from excite_cli.scoring.changes import Change, Changes
from excite_cli.summary.changes import changes_table, sentences

_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "purple", "ink", "muted")
_DAY = 86_400.0  # s


def trend_page(changes: Changes, title: str) -> Page:
    """The page of `changes`: charts of what belongs to a joint, and the table of all."""
    friction, others = _by_quantity(changes)
    sections = [
        PageSection(anchor, name, (Charts(tuple(_plot(changes, own) for own in quantities)),))
        for anchor, name, quantities in (
            ("friction", "Friction of the joints", friction),
            ("others", "What else belongs to a joint", others),
        )
        if quantities
    ]
    return Page(
        title,
        sentences(changes)[0],
        (
            KeyFigure("days", str(len(changes.days))),
            KeyFigure(
                "parameters that changed", f"{len(changes.significant)} of {len(changes.changes)}"
            ),
        ),
        (*sections, PageSection("changes", "Changes", (table_of(changes_table(changes)),))),
    )


def _by_quantity(changes: Changes) -> tuple[list[list[Change]], list[list[Change]]]:
    """Changes of one quantity together, those of friction, and others; joints in order of name."""
    groups: dict[str, list[Change]] = {}
    for change in sorted(changes.changes, key=lambda each: each.joint):
        if change.joint and change.quantity:
            groups.setdefault(change.quantity, []).append(change)
    friction = [own for own in groups.values() if own[0].friction]
    return friction, [own for own in groups.values() if not own[0].friction]


def _plot(changes: Changes, own: list[Change]) -> Plot:
    axis, x = _days(changes)
    unit = f" [{own[0].unit}]" if own[0].unit not in ("", "1") else ""
    most = len(_COLOURS)
    ends = [_ends(each) for each in own]
    shown = [x for both in ends for x in np.concatenate(both).tolist() if np.isfinite(x)]
    panels = tuple(
        Panel(
            f"{own[0].quantity}{unit}",
            tuple(_series(each, _COLOURS[k]) for k, each in enumerate(own[at : at + most])),
            limits_about(shown or [0.0]),
            height=220,
        )
        for at in range(0, len(own), most)
    )
    changed = [f"{each.joint} since {each.since}" for each in own if each.significant]
    told = ", ".join(changed) or "none"
    return Plot(
        own[0].quantity,
        f"{own[0].quantity} of {len(own)} joints over {len(x)} days; changed: {told}.",
        axis,
        x,
        panels,
        caption=f"Whiskers: two standard deviations. Changed: {told}.",
        wide=True,
        counted=axis == "day",
    )


def _series(change: Change, colour: Colour) -> Curve:
    return Curve(change.joint, np.array(change.values), colour, "joined", *_ends(change))


def _ends(change: Change) -> tuple[Array, Array]:
    """Ends of the whiskers."""
    y, std = np.array(change.values), np.array(change.stds)
    return y - 2.0 * std, y + 2.0 * std


def _days(changes: Changes) -> tuple[str, Array]:
    """Days since the first where stamps are known and rise, else their numbers."""
    stamps = [np.nan if each is None else each for each in changes.epochs]
    since = (np.array(stamps) - stamps[0]) / _DAY
    if np.isfinite(since).all() and (np.diff(since) > 0.0).all():
        return "days since the first", since
    return "day", np.arange(1.0, len(stamps) + 1.0)
