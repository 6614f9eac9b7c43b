"""Inspected motions: a table each, why something is not proved, and the data of it."""

from typing import Any

from excite_cli.excitation.inspection import Inspection, Inspections, not_modelled
from excite_cli.excitation.problem import Problem
from excite_cli.fields import data_of
from excite_cli.geometry.reasons import standing_in_words
from excite_cli.shown.answer import Answer, Parts, Table, show
from excite_cli.summary.pairs import not_modelled_in_words, pairs_data, pairs_in_words, worst_data

_CAPTION = "Margins are distances to the limit, beyond any safety margin that the config requires."


def check_answer(found: Inspections, file: str, problem: Problem) -> Answer:
    """What `excite check` answers about the motions of `file`, within the limits of `problem`."""
    data = {
        "file": file,
        "ok": not found.violations,
        "motions": [_data(found, k, name) for k, name in enumerate(found, start=1)],
        "rate": found.look.rate,
        "random": found.look.random,
        "slow": found.slow,
        "pairs": pairs_data(problem),
        "not_modelled": list(not_modelled(problem)),
    }
    parts = inspections_parts(found)
    parts[-1:-1] = [*pairs_in_words(problem), not_modelled_in_words(problem)]
    return Answer(tuple(parts), data, good=not found.violations)


def inspections_parts(found: Inspections) -> Parts:
    """A table for each motion, and sentences."""
    look = found.look
    title = f"margins at {look.rate:g} Hz"
    title += f" and {look.random} random instants" if look.random else ""
    tables = [_table(f"{name}: worst {title}", each) for name, each in found.items()]
    notes = [note for name in found for note in _notes(found, name)]
    alarms = [words for name in found for words in _alarms(name, found[name])]
    summary = f"{found.violations} violations" if found.violations else "No violation."
    return [*alarms, *tables, _CAPTION, *notes, *_agreement(found), summary]


def _table(title: str, inspection: Inspection) -> Table:
    rows = (
        {
            "constraint": key,
            "margin": f"{worst.margin:.5f}",
            "unit": worst.unit,
            "where": worst.label,
            "time [s]": f"{worst.time:.4f}",
            "verdict": "BROKEN" if state == "broken" else state,
        }
        for key, (state, _) in inspection.states.items()
        for worst in [inspection.margins[key]]
    )
    return Table.of(title, rows, left=("constraint", "unit", "verdict"), words=("where",))


def _alarms(name: str, inspection: Inspection) -> list[str]:
    """Constraints of which two computations differ."""
    return [
        f"{name}: BROKEN: {each.name} of {each.label} at {each.time:.4f} s: the program's own "
        f"margin and that of Pinocchio and coal differ by {each.difference:.2g} {each.unit}. One "
        "of them is wrong: trust neither, play nothing, and report this with the config."
        for each in inspection.disagreeing
    ]


def _agreement(found: Inspections) -> list[str]:
    """By how much the two computations of distances differ at most, over all motions."""
    paths = [each for inspection in found.values() for each in inspection.second]
    lines = []
    for name in dict.fromkeys(each.name for each in paths):
        of = [each for each in paths if each.name == name]
        most = max(of, key=lambda each: each.difference)
        lines.append(
            f"{name}: recomputed with Pinocchio and coal at {sum(each.instants for each in of)} of "
            f"{sum(each.of for each in of)} instants, those of lowest margin among them; largest "
            f"difference {most.difference:.1g} {most.unit}."
        )
    return lines


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
            f"{name}: meshes of {gap.first} and {gap.second} touch; not judged "
            f"({standing_in_words(gap.standing)})."
            for gap in inspection.meshes.told
        ]
    if off.broken:
        notes.append(
            f"{name}: BROKEN: the samples stored in the file differ from its coefficients by "
            f"{off.share:.2g} of the largest value at {off.time:.4f} s; someone changed one of "
            "them."
        )
    if found.doubt(name):
        notes.append(
            f"{name}: {found.doubt(name)}: what its file says of it does not count, and is not "
            "renewed by this check, which holds for the motion as it is now. `excite optimize "
            "CONFIG --start FILE -o NEW.h5` makes a proved motion of it."
        )
    return notes


def _data(found: Inspections, index: int, name: str) -> dict[str, Any]:
    inspection, off = found[name], found.difference(name)
    margins, second = inspection.margins, ("instants", "of", "difference", "unit", "time", "agrees")
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
        "samples_differ": data_of(off, "share", "time"),
        "doubt": found.doubt(name) or None,
        "second_path": {
            each.name: {**data_of(each, *second), "where": each.label} for each in inspection.second
        },
    }
    if inspection.meshes is not None:
        gaps, times = inspection.meshes.gaps, inspection.meshes.times
        data["meshes"] = {
            **data_of(gaps, "pairs", "beyond"),
            "always_in_contact": [list(pair) for pair in gaps.always],
            "near": [
                {
                    **data_of(gap, "distance", "touching"),
                    "links": [gap.first, gap.second],
                    "time": float(times[gap.index]),
                    "not_judged": standing_in_words(gap.standing),
                }
                for gap in gaps.near
            ],
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
