"""What a self-test found, in a sentence, tables and as data."""

from math import isnan, nan

from excite_cli.fields import data_of
from excite_cli.report.outcome_chart import outcome_chart
from excite_cli.shown.answer import (
    Answer,
    Charts,
    KeyFigure,
    Page,
    Parts,
    Section,
    Table,
    Text,
    show,
)
from excite_cli.study.selftest import OPEN, Outcome, Selftest, SelftestCase
from excite_cli.summary.cells import figure, percent

_LETTERS = dict(zip(Outcome, "Fc-W!", strict=True))
_LEGEND = (
    "F found, c confounded with another effect, - not found, W wrong (an effect elsewhere is "
    "confirmed), ! failed"
)
_COLUMNS = (
    "power: predicted probability to name it, with the noise that is simulated; predicted: the "
    "outcome that power and the likeness to other effects say before the trial; size: found, as a "
    "share of what was planted."
)
_MORE = (
    "like: the effect that is most easily taken for it; before, after: held-out error; confirmed: "
    "other effects of the answer."
)


def selftest_answer(found: Selftest, verbose: bool = False, folder: str = "") -> Answer:
    """What `excite selftest` answers; status 1 where a case is wrong or failed.

    With `verbose` also sizes in their units, and errors; `folder`: where all is kept.
    """
    counts = {str(each): found.count(each) for each in Outcome}
    data = {"robot": found.robot, "asked": found.asked, "outcomes": counts}
    data |= {"cases": data_of(found.cases), "output": folder or None}
    parts = _parts(found)
    if found.cases:
        hint = "(--verbose shows sizes, errors, and what else was confirmed.)"
        parts += [_details(found), _MORE] if verbose else [hint]
    return Answer((*parts, *([folder] if folder else [])), data, found.good)


def selftest_page(found: Selftest) -> Page:
    """The answer with all its tables, for a browser."""
    figures = [KeyFigure(str(each), str(found.count(each))) for each in Outcome]
    sections = (
        Section("outcomes", "Outcomes", (*_chart(found), _overview(found), _LEGEND)),
        Section("predicted", "Predicted and seen", (*_failures(found), _cases(found), _COLUMNS)),
        Section("sizes", "Sizes and errors", (_details(found), _MORE)),
    )
    title, answer = f"Self-test of {found.robot}", Text(_in_words(found), "answer")
    return Page(title, "Planted effects and their diagnoses", tuple(figures), sections, (answer,))


def _chart(found: Selftest) -> tuple[Charts, ...]:
    return (Charts((outcome_chart(found),)),) if found.cases else ()


def _parts(found: Selftest) -> Parts:
    """The sentence, outcomes by kind and joint, and what was predicted of every case."""
    tables: Parts = [_overview(found), _LEGEND, *_failures(found), _cases(found), _COLUMNS]
    return [_in_words(found), *(tables if found.cases else [])]


def _in_words(found: Selftest) -> str:
    """How many planted effects would be found, and what becomes of the others."""
    total, first = len(found.cases), found.count(Outcome.FOUND)
    others = [f"{found.count(each)} {each}" for each in [*Outcome][1:] if found.count(each)]
    text = f"{first} of {total} planted effects would be found"
    text += f" ({', '.join(others)})" if others else ""
    left = found.asked - total
    text += f"; {left} not tried, since it was stopped" if left else ""
    told = [case for case in found.cases if case.predicted]
    if told:
        right = sum(case.outcome == case.predicted for case in told)
        text += f". Of {len(told)} predictions {right} came true"
        unsure = sum(case.predicted == OPEN for case in told)
        text += f" and {unsure} left it open" if unsure else ""
    return f"{text}."


def _failures(found: Selftest) -> list[str]:
    return [f"{case.effect} failed: {case.message}" for case in found.cases if case.message]


def _overview(found: Selftest) -> Table:
    """A row per kind, a column per joint."""
    by_joint = sorted(found.cases, key=lambda case: found.joint_names.index(case.joints[0]))
    places = list(dict.fromkeys("+".join(case.joints) for case in by_joint))
    rows: dict[str, dict[str, str]] = {}
    for case in sorted(found.cases, key=lambda it: it.kind):
        row = rows.setdefault(case.kind, {"effect": case.kind, **dict.fromkeys(places, "")})
        row["+".join(case.joints)] += _LETTERS[Outcome(case.outcome)]
    return Table.of("Outcome by kind and joint", rows.values(), left=("effect",))


def _cases(found: Selftest) -> Table:
    rows = [
        {
            **_place(case),
            "power": _or_none(case.power, f"{case.power:.0%}"),
            "predicted": case.predicted or "-",
            "seen": case.outcome,
            "size": _or_none(case.found, f"{case.found / (case.planted or nan):.0%}"),
        }
        for case in _in_order(found)
    ]
    return Table.of("Planted effects", rows, ("effect", "where", "predicted", "seen"))


def _details(found: Selftest) -> Table:
    rows = [
        {
            **_place(case),
            "planted": figure(case.planted),
            "found ± std": _or_none(case.found, f"{figure(case.found)} ± {figure(case.std)}"),
            "unit": case.unit,
            "before": percent(case.before),
            "after": percent(case.after),
            "like": case.rival,
            "confirmed": ", ".join(
                name for name in case.named.split(", ") if name != "@".join(_place(case).values())
            ),
        }
        for case in _in_order(found)
    ]
    words = ("like", "confirmed")
    return Table.of("Sizes and errors", rows, ("effect", "where", "unit"), words)


def _or_none(value: float, text: str) -> str:
    return "-" if isnan(value) else text


def _place(case: SelftestCase) -> dict[str, str]:
    return {"effect": case.kind, "where": "+".join(case.joints)}


def _in_order(found: Selftest) -> list[SelftestCase]:
    return sorted(found.cases, key=lambda case: (case.kind, case.joints))


show(Selftest, _in_words, _parts)
