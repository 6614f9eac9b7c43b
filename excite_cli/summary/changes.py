"""What changed between days, in sentences, a table and as data."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.diagnosis.words import p_in_words
from excite_cli.fields import data_of
from excite_cli.identification.fit_words import with_deviation
from excite_cli.report.chart import Colour, limits_about
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.robot.model import Array
from excite_cli.scoring.changes import Change, Changes
from excite_cli.shown.answer import Answer, Charts, KeyFigure, Page, Parts, Section, Table, show
from excite_cli.summary.cells import files_in_words

_LEAST_P = 1e-16  # of any sum of so many rounded numbers, smaller ones say nothing
_SHOWN = 12  # rows at least, changed or not
_TOLD = 4


def changes_answer(found: Changes, page: str | Path | None = None) -> Answer:
    """What `excite compare` answers; `page` was written."""
    files = {} if page is None else {"page": str(page)}
    parts = (*changes_parts(found), *files_in_words(files))
    return Answer(parts, {**changes_data(found), **files})


def changes_parts(found: Changes) -> Parts:
    """A sentence, and the parameters, the surest change first."""
    tables = changes_tables(found)
    left = len(found.changes) - sum(len(table.rows) for table in tables)
    rest = [f"{left} more parameters did not change significantly."] if left else []
    return [*sentences(found), *tables, *rest]


def changes_tables(found: Changes) -> list[Table]:
    """The parameters that changed, and some that did not."""
    changed, several = found.significant, len(found.days) > 2
    others = found.changes[len(changed) : max(_SHOWN, len(changed))]
    tables = [_table(shown, several) for shown in (changed, others) if shown]
    corrected = "p corrected for the number of parameters and data sets"
    titles = (f"Changed (± std of the change; {corrected})", "Not significant, the surest first")
    own = [title for title, shown in zip(titles, (changed, others), strict=True) if shown]
    return [replace(table, title=title) for table, title in zip(tables, own, strict=True)]


def _table(shown: Sequence[Change], several: bool = True) -> Table:
    """`several`: there are more than two days, of which a change is since one."""
    rows = (
        {
            "parameter": change.name,
            "before": f"{change.before:.4g}" if abs(change.before) > 1e-9 * change.std else "0",
            "after": with_deviation(change.after, change.std),
            "unit": change.unit,
            **({"since": change.since} if several else {}),
            "p": p_in_words(change.p_value, _LEAST_P) if change.p_value < 0.995 else "1",
        }
        for change in shown
    )
    bold = tuple(k for k, change in enumerate(shown) if change.significant)
    return Table.of("", rows, left=("parameter", "unit", "since"), bold=bold)


def sentences(found: Changes) -> list[str]:
    """What changed since when."""
    out = f" beside {', '.join(found.columns)}" if found.columns else ""
    over = f"{len(found.days)} data sets, {len(found.changes)} parameters{out}"
    if not found.significant:
        return [f"No significant change ({over})."]
    told = [_told(change) for change in found.significant[:_TOLD]]
    more = len(found.significant) - len(told)
    rest = [f"and {more} more"] if more > 0 else []
    return [f"{'; '.join([*told, *rest])} ({over})."]


def _told(change: Change) -> str:
    verb = "rose" if change.after > change.before else "fell"
    if min(change.before, change.after) < 0.0:
        verb = "changed"  # "rose" would be of the size for one reader, of the value for another
    unit = f" {change.unit}" if change.unit not in ("", "1") else ""
    return (
        f"{change.name} {verb} from {change.before:.3g} to "
        f"{with_deviation(change.after, change.std)}{unit} since {change.since}"
    )


def changes_data(found: Changes) -> dict[str, Any]:
    """The answer for `--json`."""
    own = ("name", "joint", "unit", "before", "after", "std", "p_value", "significant", "since",
           "values", "stds", "taken_out")  # fmt: skip
    return {
        "answer": sentences(found),
        **data_of(found, "days", "epochs", "covariates"),
        "changes": [data_of(change, *own) for change in found.changes],
    }


# The page: every quantity of the joints over the days, as a chart. Friction comes first; a point
# has a whisker of two standard deviations to each side.

_COLOURS: tuple[Colour, ...] = ("blue", "vermilion", "green", "purple", "ink", "muted")
_DAY = 86_400.0  # s


def trend_page(changes: Changes, title: str) -> Page:
    """Charts of what belongs to a joint, and the table of all."""
    friction, others = _by_quantity(changes)
    sections = [
        Section(anchor, name, (Charts(tuple(_plot(changes, own) for own in quantities)),))
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
        (*sections, Section("changes", "Changes", tuple(changes_tables(changes)))),
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


show(Change, _told, lambda change: [_table([change])])
show(Changes, lambda found: sentences(found)[0], changes_parts)
