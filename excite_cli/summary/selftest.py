"""What a self-test found, in a sentence, tables and as data."""

from math import isnan
from typing import Any

from excite_cli.fields import data_of
from excite_cli.shown.answer import Answer, Parts, Table, show
from excite_cli.study.selftest import Outcome, Selftest, SelftestCase
from excite_cli.summary.cells import figure, percent

_LETTERS = {
    Outcome.FOUND: "F",
    Outcome.CONFOUNDED: "c",
    Outcome.NOT_FOUND: "-",
    Outcome.WRONG: "W",
    None: "!",
}
_LEGEND = (
    "F found, c confounded with another effect, - not found, W wrong (an effect elsewhere is "
    "confirmed), ! failed"
)


def selftest_answer(found: Selftest, folder: str | None = None) -> Answer:
    """What `excite selftest` answers; status 1 where a case is wrong or failed."""
    return Answer(tuple(selftest_parts(found)), selftest_data(found, folder), found.good)


def selftest_parts(found: Selftest) -> Parts:
    """The sentence, outcomes by kind and joint, and every case with its sizes."""
    tables: Parts = [_overview(found), _LEGEND, _cases(found)]
    return [in_words(found), *(tables if found.cases else [])]


def in_words(found: Selftest) -> str:
    """How many planted effects would be found, and what becomes of the others."""
    total = len(found.cases)
    if not total:
        return "No case is done."
    plural = "s" if total > 1 else ""
    text = f"{found.count(Outcome.FOUND)} of {total} planted effect{plural} would be found"
    others = {
        "confounded with another": Outcome.CONFOUNDED,
        "not found": Outcome.NOT_FOUND,
        "answered with a wrong name": Outcome.WRONG,
        "failed": None,
    }
    counts = [f"{found.count(o)} {words}" for words, o in others.items() if found.count(o)]
    text += f" ({', '.join(counts)})" if counts else ""
    left = found.asked - total
    text += f"; {left} not tried: stopped before" if left else ""
    known = [case for case in found.cases if not isnan(case.power) and case.outcome is not None]
    if known:
        text += (
            f". Of {len(known)} with a predicted power, {sum(case.power for case in known):.1f} "
            f"were predicted to be named and {_count(known)} are found"
        )
    return f"{text}."


def _count(cases: list[SelftestCase]) -> int:
    return sum(case.outcome is Outcome.FOUND for case in cases)


def _overview(found: Selftest) -> Table:
    """A row per kind, a column per joint."""
    by_joint = sorted(found.cases, key=lambda case: found.joint_names.index(case.joints[0]))
    places = list(dict.fromkeys(map(_place, by_joint)))
    kinds = sorted({case.kind for case in found.cases})
    rows = []
    for kind in kinds:
        letters = dict.fromkeys(places, "")
        for case in found.cases:
            if case.kind == kind:
                letters[_place(case)] += _LETTERS[case.outcome]
        rows.append((kind, *letters.values()))
    return Table("Outcome by kind and joint", ("effect", *places), tuple(rows), left=("effect",))


def _cases(found: Selftest) -> Table:
    rows = tuple(_row(case) for case in sorted(found.cases, key=lambda it: (it.kind, it.joints)))
    names = (
        "effect", "where", "outcome", "planted", "found ± std", "unit", "power", "before", "after",
        "confirmed",
    )  # fmt: skip
    note = (
        "power: probability with which the motions were predicted to show this size (noise as for "
        "planning: 2% of the usual torque in 20 independent samples a second); before, after: "
        "held-out error; confirmed: what the diagnosis named otherwise."
    )
    left, words = ("effect", "where", "unit"), ("outcome", "confirmed")
    return Table("Planted effects", names, rows, left=left, words=words, note=note)


def _row(case: SelftestCase) -> tuple[str, ...]:
    own = f"{case.kind}@{_place(case)}"
    found = "-" if isnan(case.found) else f"{figure(case.found)} ± {figure(case.std)}"
    power = "-" if isnan(case.power) else f"{case.power:.0%}"
    others = [name for name in case.named if name != own]
    outcome = case.message if case.outcome is None else str(case.outcome)
    return (
        case.kind, _place(case), outcome, figure(case.planted), found, case.unit, power,
        percent(case.before), percent(case.after), ", ".join(others),
    )  # fmt: skip


def _place(case: SelftestCase) -> str:
    return "+".join(case.joints)


def selftest_data(found: Selftest, folder: str | None) -> dict[str, Any]:
    """The same for `--json`; what is not known is null."""
    cases = [data_of(case) for case in found.cases]
    counts = {str(each): found.count(each) for each in Outcome} | {"failed": found.count(None)}
    return {"robot": found.robot, "asked": found.asked, "outcomes": counts, "cases": cases,
            "output": folder}  # fmt: skip


show(Selftest, in_words, selftest_parts)
