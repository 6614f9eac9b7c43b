"""Planned motions: condition numbers beside each other, worst margins, what comes after them."""

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np

from excite_cli.config.spec import UntilSpec
from excite_cli.diagnosis.expectation import expectation
from excite_cli.diagnosis.goals import Goal, Goals
from excite_cli.diagnosis.next_motion import NextMotion
from excite_cli.excitation.inspection import not_modelled
from excite_cli.excitation.invariant import Invariants, design_for, invariants
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Status
from excite_cli.excitation.result import Comparison, RandomMotion, Result
from excite_cli.excitation.sequence import flattered
from excite_cli.fields import data_of
from excite_cli.report.record_plots import plot_motion
from excite_cli.shown.answer import Answer, Detail, Parts, Table, show
from excite_cli.summary.pairs import (
    doubts_in_words,
    not_modelled_in_words,
    pairs_data,
    pairs_in_words,
    worst_data,
)
from excite_cli.summary.problem_notes import problem_parts
from excite_cli.summary.weakest import expectation_parts, power_data
from excite_cli.trajectory.fade import Segment


def plan_answer(
    planned: Problem | NextMotion,
    result: Result,
    output: str,
    efficiency: bool = False,
    power: Mapping[str, float] | None = None,
) -> Answer:
    """What `excite optimize` answers: the motions, and what they are expected to tell.

    With `efficiency` also their share of the information that freely chosen states could have,
    which takes seconds; `power`: sizes of effects, by kind, that they should show.
    """
    following = planned if isinstance(planned, NextMotion) else None
    model = planned.model if isinstance(planned, NextMotion) else planned
    parts: Parts = [*result_parts(result), output]
    data: dict[str, Any] = {
        "motions": [motion_data(m) for m in result.motions],
        "criterion": criterion_data(model),
        "pairs": pairs_data(model),
        "not_modelled": list(not_modelled(model)),
        "output": output,
    }
    parts[-1:-1] = [*pairs_in_words(model), not_modelled_in_words(model)]
    good, until = True, model.spec.sequence.until
    if model.spec.criterion.of == "robot" and result.motions:
        judged = efficiency or (until is not None and until.efficiency is not None)
        found = invariants(model, result.stack, design_for(model) if judged else None)
        data |= data_of(found, "torque_deviation", "efficiency")
        data["efficiency_slack"] = found.slack  # the efficiency is at most too high by exp(slack)
        if found.efficiency is not None:
            parts.insert(-1, invariants_in_words(found))
        expected = expectation(model, result, power, following.known if following else None)
        for each, deviation in zip(data["motions"], expected.deviations, strict=True):
            each["predicted_deviation"] = deviation
        data["power"] = power_data(expected.power)
        parts[:0] = expectation_parts(model, expected, bool(power))
        if until is not None:
            seconds = len(result.motions) * model.trajectory.duration
            goals = Goals(model, following.known if following else None).of(result)
            good = all(goal.needed <= 1.0 for goal in goals)
            words = ending_in_words(until, goals, seconds, not result.priors)
            parts.insert(-1 if good else 0, words)
            data["until"] = {"reached": good, "seconds": seconds}
    if following is not None:
        outlook = following.outlook([m.coefficients for m in result.motions])
        data["next_experiment"] = outlook
        if outlook["pairs"]:
            parts.insert(0, outlook_table(outlook))
    return Answer(tuple(parts), data, good)


def ending_in_words(
    until: UntilSpec, goals: Sequence[Goal], seconds: float, alone: bool = True
) -> str:
    """What `sequence.until` asks for, beside what motions of so many `seconds` in all have.

    alone: there are no earlier data, so that more such motions show as much as these.
    """
    total = f"{seconds:.4g} s of motion in all"
    if not until.precise:
        return f"{total}, of {until.duration:g} s that sequence.until.duration allows."
    lacking = [goal for goal in goals if goal.needed > 1.0]
    words = "; ".join(goal.words for goal in lacking or goals)
    if not lacking:
        return f"sequence.until is reached with {total}: {words}."
    needed = seconds * max(goal.needed for goal in lacking)
    said = f"sequence.until is NOT REACHED with {total}: {words}."
    if not alone or needed == np.inf:
        return said
    return f"{said} About {needed:.2g} s of motions like these would be enough."


def result_parts(result: Result) -> Parts:
    """Condition numbers, margins where something was asked to be kept, and what is in doubt."""
    words = doubts_in_words(result.motions)
    return [*_tables(result.motions), *(f"{each[:1].upper()}{each[1:]}." for each in words)]


def invariants_in_words(found: Invariants) -> str:
    """The share of information, the same whichever columns are called base parameters."""
    assert found.efficiency is not None
    assert found.slack is not None
    low = found.efficiency * np.exp(-found.slack)
    return (
        f"Information efficiency: {100 * low:.2g} to {100 * found.efficiency:.2g} % of D-optimal "
        "free states."
    )


_NUMBERS = ("index", "condition_number", "stacked_condition_number")


def motion_table(motions: Sequence[Motion]) -> Table:
    """Condition numbers of each motion and of the stack (the paper's Table I), status, effort."""
    planned_for_work = any(motion.predicted_deviation is not None for motion in motions)
    rows = (
        {
            "motion": str(motion.index),
            **({"deviation": _deviation(motion)} if planned_for_work else {}),
            "own": f"{motion.condition_number:.2f}",
            "stacked": f"{motion.stacked_condition_number:.2f}",
            "stacked, finely sampled": _dense(motion),
            "status": motion.status + "; no improvement" * (not motion.improved),
            "iterations": str(motion.iterations),
            "planning [s]": f"{motion.seconds:.1f}",
        }
        for motion in motions
    )
    title = "Condition numbers"
    if planned_for_work:
        title = (
            "Standard deviation of predicted torques, in units of the noise of one sample; "
            "condition numbers of the base regressor"
        )
    return Table.of(title, rows, left=("status",))


def _deviation(motion: Motion) -> str:
    deviation = motion.predicted_deviation
    return "–" if deviation is None else f"{deviation:.3f}"


def _dense(motion: Motion) -> str:
    dense = motion.dense_condition_number
    return "–" if dense is None else f"{dense:.2f}"


def margin_table(motions: Sequence[Motion], detail: Detail = Detail.BRIEF) -> Table:
    """The worst margin of every constraint over all motions, at controller rate.

    On a page also as a share of the size of what is bounded, and whether it is proved.
    """
    rows = []
    for name in dict.fromkeys(name for motion in motions for name in motion.margins):
        held = [motion for motion in motions if name in motion.margins]
        motion = min(held, key=lambda each: each.margins[name].margin)
        worst = motion.margins[name]
        states = [each.certified[name] for each in held if name in each.certified]
        state = "–" if not states else "proved" if all(states) else "sampled"
        row = {
            "constraint": name,
            "margin": f"{worst.margin:.4f}",
            "unit": worst.unit,
            "where": worst.label,
            "motion": str(motion.index),
            "time [s]": f"{worst.time:.3f}",
        }
        if detail:
            row["share of its size"] = f"{100 * worst.share:.2g} %"
            row["verdict"] = "BROKEN" if worst.violations else state
        rows.append(row)
    left = ("constraint", "unit", "verdict")
    return Table.of("Worst margins, sampled at 1 kHz", rows, left, words=("where",))


def outlook_table(outlook: dict[str, Any]) -> Table:
    """What the motions are expected to tell apart."""
    least = outlook["distinguished_from"]
    title = f"Kullback-Leibler divergence of effects [nats]; from {least:g} on, distinguished"
    rows = (
        {
            "effect": pair["effect"],
            "or": pair["alias"],
            "measured data": f"{pair['kl_so_far']:.2g}",
            "with this motion": f"{pair['expected_kl']:.3g}",
            "motions needed": str(pair["motions_needed"] or "> 1000"),
        }
        for pair in outlook["pairs"]
    )
    return Table.of(title, rows, words=("effect", "or"))


def motion_sentence(motion: Motion) -> str:
    """What is worth saying once a motion is done."""
    note = "" if motion.improved else "; it brings no improvement"
    note += " of optimizer.max_seconds per start" if motion.status is Status.TIME_LIMIT else ""
    note += f"; {motion.note}" if motion.note else ""
    if flattered(motion.stacked_condition_number, motion.dense_condition_number):
        note += f"; {_dense(motion)} between its samples: take more of sampling.cost"
    if motion.doubt:
        note += f"; not proved: {motion.doubt}"
    elif motion.certified:
        loose = [name for name, proved in motion.certified.items() if not proved]
        told = "all constraints proved at every instant"
        note += f"; not proved: {', '.join(loose)}" if loose else f"; {told}"
    figure = (
        f"condition number {motion.condition_number:.2f}, "
        f"stacked {motion.stacked_condition_number:.2f}"
    )
    if motion.predicted_deviation is not None:
        figure = f"predicted torques to {motion.predicted_deviation:.2f} of a sample's noise"
    return f"motion {motion.index}: {figure} ({motion.seconds:.1f} s, {motion.status}{note})"


def motion_data(motion: Motion) -> dict[str, Any]:
    """A motion for `--json`."""
    own = (*_NUMBERS, "dense_condition_number", "predicted_deviation", "improved", "status",
           "note", "seconds", "iterations", "evaluations", "certified")  # fmt: skip
    return {
        **data_of(motion, *own),
        "doubt": motion.doubt or None,
        "margins": {name: worst_data(worst) for name, worst in motion.margins.items()},
    }


def criterion_data(problem: Problem) -> dict[str, str]:
    """What was minimised and how it was weighted, for `--json`."""
    return {
        "kind": problem.spec.criterion.kind,
        "row_weights": problem.weighting.row_name,
        "column_scaling": problem.weighting.column_name,
    }


def _in_words(result: Result) -> str:
    count, joints = len(result.motions), len(result.joint_names)
    words = f"{count} motion{'s' * (count != 1)} of {joints} joints"
    if not result.motions:
        return words
    last = result.motions[-1]
    if last.predicted_deviation is not None:
        return f"{words}, predicted torques to {last.predicted_deviation:.2f} of a sample's noise"
    return f"{words}, stacked condition number {last.stacked_condition_number:.2f}"


def _tables(motions: Sequence[Motion]) -> Parts:
    tables: Parts = [motion_table(motions)]
    if motions and motions[0].margins:
        tables.append(margin_table(motions))
    return tables


def _segment_in_words(segment: Segment) -> str:
    joints = segment.coefficients.shape[1]
    return f"{segment.name}: {joints} joints, {segment.trajectory.duration:.4g} s"


show(Result, _in_words, result_parts, {"plot": plot_motion})
show(Motion, motion_sentence, lambda motion: _tables([motion]))
show(Segment, _segment_in_words, lambda segment: [_segment_in_words(segment)])
show(
    NextMotion,
    lambda following: following.messages[0],
    lambda following: [*following.messages, *problem_parts(following.problem)],
)


# Optimised and random motions side by side.


def comparison_answer(found: Comparison, output: str | None) -> Answer:
    """What `excite compare-random` answers."""
    baseline = found.baseline
    data = {
        "random": [
            data_of(motion, *_NUMBERS, "predicted_deviation") for motion in baseline.motions
        ],
        "optimized": [motion_data(m) for m in found.result.motions],
        **data_of(baseline, "candidates", "admissible"),
        "seconds": {"optimized": found.seconds, "random": baseline.seconds},
        "output": output,
    }
    written = [output] if output is not None else []
    return Answer((*comparison_parts(found), *written), data)


def comparison_parts(found: Comparison) -> Parts:
    """The paper's Tables I and II side by side, and how long both took."""
    table = pairs_of_numbers_table(found.result.motions, found.baseline.motions)
    return [table, _comparison_in_words(found)]


def pairs_of_numbers_table(optimized: Sequence[Motion], random: Sequence[RandomMotion]) -> Table:
    """Condition numbers, own and stacked, motion by motion.

    Of motions that are planned for torques of the work, how well these are predicted.
    """
    if any(motion.predicted_deviation is not None for motion in optimized):
        return _deviations_table(optimized, random)
    rows = []
    for index, (first, second) in enumerate(zip_longest(optimized, random), start=1):
        row = {"motion": str(index)}
        for word, motion in (("optimised", first), ("random", second)):
            row[word] = f"{motion.condition_number:.1f}" if motion else ""
            row[f"{word}, stacked"] = f"{motion.stacked_condition_number:.1f}" if motion else ""
        both = first and second
        ratio = second.stacked_condition_number / first.stacked_condition_number if both else 0.0
        rows.append({**row, "stacked ratio": f"{ratio:.2f}" if both else ""})
    return Table.of("Condition numbers, optimised and random (the paper's Tables I, II)", rows)


def _deviations_table(optimized: Sequence[Motion], random: Sequence[RandomMotion]) -> Table:
    rows = []
    for index, (first, second) in enumerate(zip_longest(optimized, random), start=1):
        one, other = (each.predicted_deviation if each else None for each in (first, second))
        row = {"motion": str(index)}
        for word, deviation in (("optimised", one), ("random", other)):
            row[word] = f"{deviation:.3f}" if deviation else ""
        rows.append({**row, "ratio": f"{other / one:.2f}" if one and other else ""})
    title = (
        "Standard deviation of predicted torques, in units of the noise of one sample, after each "
        "motion and all before"
    )
    return Table.of(title, rows)


def _comparison_in_words(found: Comparison) -> str:
    baseline = found.baseline
    return (
        f"{baseline.candidates} candidates in {baseline.seconds:.1f} s, {baseline.admissible} "
        f"admissible; the optimiser took {found.seconds:.1f} s"
    )


show(Comparison, _comparison_in_words, comparison_parts)
