"""What changed, in words: the value before and after, not only their difference."""

from collections.abc import Iterator

from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.effects.base import Value
from excite_cli.effects.catalogue import catalogue
from excite_cli.effects.parameter import unit_of_slider

_SURE = 2.0  # standard deviations from which a change is told
_LONG = ((3600.0, "h"), (60.0, "min"), (1.0, "s"))


def changes_in_words(found: Diagnosis) -> list[str]:
    """A sentence for all that changed over the campaign, with a column, or in some runs."""
    return [text for named in found.named for text in _told(found, named)]


def _told(found: Diagnosis, named: NamedEffect) -> Iterator[str]:
    record = named.effect
    kind = catalogue().get(record.kind)
    if kind is None or not (kind.changes_of or (kind.changes_between_runs and record.runs)):
        return
    changed = kind.changes_of or (record.kind,)
    for parameter, of in zip(kind.parameters, changed, strict=False):
        change, start = named.parameters[parameter.name], _shared(found, of, record.joints)
        if abs(change.value) <= _SURE * change.std:
            continue
        what = f"{catalogue()[of].title} of {', '.join(record.joints)}"
        if record.covariate:
            yield what + _by_column(change, start, record.shape.get("reference"))
            continue
        if start is None:
            continue
        unit = catalogue()[of].parameters[0].unit
        unit = unit if change.unit == parameter.unit else unit_of_slider(unit)
        end = Value(start + change.value, change.std, unit)
        if kind.of_campaign:
            how = "fell" if abs(end.value) < abs(start) else "rose"
            over = _duration(record.shape["span"])
            yield f"{what} {how} from {start:.3g} to {end.value:.3g} {end.unit} over {over}."
        else:
            runs = ", ".join(record.runs)
            yield f"{what}: {end.value:.3g} instead of {start:.3g} {end.unit} in {runs}."


def _by_column(slope: Value, there: float | None, reference: float | None) -> str:
    """` falls by 0.021 N·m per unit of temp_j1; it is 1.3 at 35.2.`"""
    how = "falls" if slope.value < 0.0 else "rises"
    told = f" {how} by {abs(slope.value):.3g} {slope.unit}"
    known = there is not None and reference is not None
    return told + (f"; it is {there:.3g} at {reference:.4g}." if known else ".")


def _shared(found: Diagnosis, kind: str, joints: tuple[str, ...]) -> float | None:
    """What all runs have of a kind, found or declared."""
    for record in (*(each.effect for each in found.effects), *found.information.model):
        if (record.kind, record.joints, record.runs) == (kind, joints, ()) and record.values:
            return record.values[0]
    return None


def _duration(seconds: float) -> str:
    size, unit = next((each for each in _LONG if seconds >= 2.0 * each[0]), _LONG[-1])
    return f"{seconds / size:.3g} {unit}"
