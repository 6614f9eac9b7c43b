"""What changed between days, in sentences, a table and as data."""

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from excite_cli.diagnosis.words import p_in_words
from excite_cli.identification.fit_words import with_deviation
from excite_cli.scoring.changes import Change, Changes
from excite_cli.shown.answer import Answer, Parts, Table
from excite_cli.shown.record import show
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
    table = changes_table(found)
    left = len(found.changes) - len(table.rows)
    rest = [f"{left} more parameters did not change significantly."] if left else []
    return [*sentences(found), table, *rest]


def changes_table(found: Changes) -> Table:
    """The parameters that changed, and some that did not."""
    return _table(found.changes[: max(_SHOWN, len(found.significant))])


def _table(shown: Sequence[Change]) -> Table:
    rows = tuple(
        (
            change.name,
            f"{change.before:.4g}" if abs(change.before) > 1e-9 * change.std else "0",
            with_deviation(change.after, change.std),
            change.unit,
            change.since,
            p_in_words(change.p_value, _LEAST_P) if change.p_value < 0.995 else "1",
            "CHANGED" if change.significant else "",
        )
        for change in shown
    )
    return Table(
        "Changes (± std of the change; p corrected for the number of parameters and data sets)",
        ("parameter", "before", "after", "unit", "since", "p", "verdict"),
        rows,
        left=("parameter", "unit", "since", "verdict"),
        bold=tuple(k for k, change in enumerate(shown) if change.significant),
    )


def sentences(found: Changes) -> list[str]:
    """What changed since when."""
    out = f" beside {', '.join(found.columns)}" if found.columns else ""
    over = f"{len(found.days)} data sets, {len(found.changes)} parameters{out}"
    if not found.significant:
        return [f"No significant change ({over})."]
    # Sums of inertial parameters are hard to read: the table has them.
    short = [each for each in found.significant if " " not in each.name] or found.significant
    told = [_told(change) for change in short[:_TOLD]]
    more = len(found.significant) - len(told)
    rest = [f"and {more} more"] if more > 0 else []
    return [f"{'; '.join([*told, *rest])} ({over})."]


def _told(change: Change) -> str:
    verb = "rose" if change.after > change.before else "fell"
    unit = f" {change.unit}" if change.unit not in ("", "1") else ""
    return (
        f"{change.name} {verb} from {change.before:.3g} to "
        f"{with_deviation(change.after, change.std)}{unit} since {change.since}"
    )


def changes_data(found: Changes) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "answer": sentences(found),
        "days": list(found.days),
        "epochs": list(found.epochs),
        "covariates": {name: list(values) for name, values in found.covariates.items()},
        "changes": [
            {
                "name": change.name,
                "joint": change.joint,
                "unit": change.unit,
                "before": change.before,
                "after": change.after,
                "std": change.std,
                "p_value": change.p_value,
                "significant": change.significant,
                "since": change.since,
                "values": [x if isfinite(x) else None for x in change.values],
                "stds": [x if isfinite(x) else None for x in change.stds],
                "taken_out": change.taken_out,
            }
            for change in found.changes
        ],
    }


show(Change, _told, lambda change: [_table([change])])
show(Changes, lambda found: sentences(found)[0], changes_parts)
