"""Inspected motions: a table each, why something is not proved, and the data of it."""

from typing import Any

from excite_cli.excitation.inspection import Inspection
from excite_cli.excitation.inspections import Inspections
from excite_cli.shown.answer import Answer
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts, Table
from excite_cli.summary.margins import worst_data

_CAPTION = "A margin is what is left beyond what the config asks to keep."


def check_answer(found: Inspections, file: str) -> Answer:
    """What `excite check` answers about the motions of `file`."""
    data = {
        "file": file,
        "ok": not found.violations,
        "motions": [_data(found, k, name) for k, name in enumerate(found, start=1)],
        "rate": found.look.rate,
        "random": found.look.random,
        "slow": found.slow,
    }
    return Answer(tuple(inspections_parts(found)), data, good=not found.violations)


def inspections_parts(found: Inspections) -> Parts:
    """A table for each motion, and sentences."""
    look = found.look
    title = f"margins at {look.rate:g} Hz"
    title += f" and {look.random} random instants" if look.random else ""
    tables = [_table(f"{name}: worst {title}", each) for name, each in found.items()]
    notes = [note for name in found for note in _notes(found, name)]
    summary = f"{found.violations} violations" if found.violations else "No violation."
    return [*tables, _CAPTION, *notes, summary]


def _table(title: str, inspection: Inspection) -> Table:
    rows = []
    for key, (state, _) in inspection.states.items():
        worst = inspection.margins[key]
        figures = (f"{worst.margin:.5f}", worst.unit, worst.label, f"{worst.time:.4f}")
        rows.append((key, *figures, "BROKEN" if state == "broken" else state))
    names = ("constraint", "margin", "unit", "where", "time [s]", "verdict")
    return Table(title, names, tuple(rows), ("constraint", "unit", "verdict"), ("where",))


def _notes(found: Inspections, name: str) -> list[str]:
    """Why something is not proved, and what else one should know."""
    inspection, off = found[name], found.difference(name)
    notes = [
        f"{name}: {key} is not proved: {reason}."
        for key, (state, reason) in inspection.states.items()
        if state == "sampled"
    ]
    if inspection.meshes is not None:
        notes += [
            f"{name}: meshes of {gap.first} and {gap.second} touch; not judged ({gap.standing})."
            for gap in inspection.meshes.told
        ]
    if off.broken:
        notes.append(
            f"{name}: BROKEN: the samples stored in the file differ from its coefficients by "
            f"{off.share:.2g} of the largest value at {off.time:.4f} s; someone changed one of "
            "them."
        )
    return notes


def _data(found: Inspections, index: int, name: str) -> dict[str, Any]:
    inspection, off = found[name], found.difference(name)
    margins = inspection.margins
    data: dict[str, Any] = {
        "index": index,
        "name": name,
        "margins": {key: worst.margin for key, worst in margins.items()},
        "worst": {key: worst_data(worst) for key, worst in margins.items()},
        "violations": found.violations_of(name),
        "certified": inspection.certified,
        "verdicts": {
            key: {"state": state, "reason": reason}
            for key, (state, reason) in inspection.states.items()
        },
        "samples_differ": {"share": off.share, "time": off.time},
    }
    if inspection.meshes is not None:
        gaps, times = inspection.meshes.gaps, inspection.meshes.times
        data["meshes"] = {
            "pairs": gaps.pairs,
            "beyond": gaps.beyond,
            "near": [
                {
                    "links": [gap.first, gap.second],
                    "distance": gap.distance,
                    "time": float(times[gap.index]),
                    "touching": gap.touching,
                    "not_judged": gap.standing,
                }
                for gap in gaps.near
            ],
            "always_in_contact": [list(pair) for pair in gaps.always],
        }
    return data


def _in_words(found: Inspections) -> str:
    return ", ".join(f"{name}: {_counted(found.violations_of(name))}" for name in found)


def _counted(violations: int) -> str:
    return f"{violations} violations" if violations else "no violation"


def _states(inspection: Inspection) -> str:
    """`no violation; joint_position proved, …`."""
    states = ", ".join(f"{key} {state}" for key, (state, _) in inspection.states.items())
    return f"{_counted(inspection.violations)}; {states}"


show(Inspections, _in_words, inspections_parts)
show(Inspection, _states, lambda found: [_table("Worst margins", found)])
