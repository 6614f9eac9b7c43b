"""What a self-test found, in a sentence, tables and as data."""

from math import isnan

from excite_cli.fields import data_of
from excite_cli.shown.answer import Answer, Parts, Table, show
from excite_cli.study.selftest import Outcome, Selftest, SelftestCase
from excite_cli.summary.cells import figure, percent

_LETTERS = dict(zip(Outcome, "Fc-W!", strict=True))
_LEGEND = (
    "F found, c confounded with another effect, - not found, W wrong (an effect elsewhere is "
    "confirmed), ! failed"
)
_POWER = (
    "power: predicted probability to name this size, with the noise that planning assumes; before, "
    "after: held-out error; confirmed: other effects of the answer."
)


def selftest_answer(found: Selftest) -> Answer:
    """What `excite selftest` answers; status 1 where a case is wrong or failed."""
    counts = {str(each): found.count(each) for each in Outcome}
    data = {"robot": found.robot, "asked": found.asked, "outcomes": counts}
    return Answer(tuple(_parts(found)), data | {"cases": data_of(found.cases)}, found.good)


def _parts(found: Selftest) -> Parts:
    """The sentence, outcomes by kind and joint, and every case with its sizes."""
    tables: Parts = [_overview(found), _LEGEND, _sizes(found), _POWER]
    return [_in_words(found), *(tables if found.cases else [])]


def _in_words(found: Selftest) -> str:
    """How many planted effects would be found, and what becomes of the others."""
    total, first = len(found.cases), found.count(Outcome.FOUND)
    others = [f"{found.count(each)} {each}" for each in [*Outcome][1:] if found.count(each)]
    text = f"{first} of {total} planted effects would be found"
    text += f" ({', '.join(others)})" if others else ""
    left = found.asked - total
    text += f"; {left} not tried, since it was stopped" if left else ""
    known = [case for case in found.cases if not isnan(case.power)]
    if known:
        named = sum(case.outcome == Outcome.FOUND for case in known)
        text += f". Of {len(known)} with a predicted power, {sum(it.power for it in known):.1f} "
        text += f"were predicted to be named and {named} are found"
    return f"{text}."


def _overview(found: Selftest) -> Table:
    """A row per kind, a column per joint."""
    by_joint = sorted(found.cases, key=lambda case: found.joint_names.index(case.joints[0]))
    places = list(dict.fromkeys("+".join(case.joints) for case in by_joint))
    rows: dict[str, dict[str, str]] = {}
    for case in sorted(found.cases, key=lambda it: it.kind):
        row = rows.setdefault(case.kind, {"effect": case.kind, **dict.fromkeys(places, "")})
        row["+".join(case.joints)] += _LETTERS[Outcome(case.outcome)]
    return Table.of("Outcome by kind and joint", rows.values(), left=("effect",))


def _sizes(found: Selftest) -> Table:
    rows = [_row(case) for case in sorted(found.cases, key=lambda it: (it.kind, it.joints))]
    words = ("outcome", "confirmed")
    return Table.of("Planted effects", rows, ("effect", "where", "unit"), words)


def _row(case: SelftestCase) -> dict[str, str]:
    where = "+".join(case.joints)
    others = [name for name in case.named.split(", ") if name != f"{case.kind}@{where}"]
    return {
        "effect": case.kind,
        "where": where,
        "outcome": f"{case.outcome} {case.message}".strip(),
        "planted": figure(case.planted),
        "found ± std": f"{figure(case.found)} ± {figure(case.std)}"
        if case.found == case.found
        else "-",
        "unit": case.unit,
        "power": "-" if isnan(case.power) else f"{case.power:.0%}",
        "before": percent(case.before),
        "after": percent(case.after),
        "confirmed": ", ".join(others),
    }


show(Selftest, _in_words, _parts)
