"""The page of planned motions: condition numbers, motions, margins, and how they were made."""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.words import counted
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.geometry.reasons import reason_in_words
from excite_cli.report.chart import in_figures
from excite_cli.report.condition_chart import condition_chart, spectrum_chart
from excite_cli.report.motion_chart import margin_charts, motion_cards, peaks_table, signals_of
from excite_cli.report.posture_chart import posture_chart
from excite_cli.shown.answer import (
    Block,
    Charts,
    Choice,
    Detail,
    Fold,
    KeyFigure,
    Section,
    Table,
    Text,
    Verdict,
)
from excite_cli.summary.motions import margin_table, motion_table, pairs_of_numbers_table
from excite_cli.summary.pairs import (
    counted_pairs,
    doubts_in_words,
    not_modelled_in_words,
    unguarded_in_words,
    unjudged,
)
from excite_cli.summary.weakest import weakest_section

# Instants per card: many joints and motions must not make the page heavy.
_POINTS, _FEWEST_POINTS, _ALL_POINTS = 400, 160, 24_000
_MOST_CHARTS = 120
_NO_BASELINE = (
    "This file holds no random motions to compare with. `excite compare-random CONFIG --optimized "
    "FILE.h5 -o BOTH.h5` draws them under the same constraints and stores both."
)


def result_sections(
    result: Result, problem: Problem, file: str, picture: bool = True
) -> list[Section]:
    """Condition numbers, motions, margins, what shows least, how it was made; `file`: its name.

    With a `picture` the robot stands beside the first, where it is nearest to something.
    """
    return [
        condition_section(result, problem, picture),
        motion_section(result, problem),
        margin_section(result, problem),
        weakest_section(result, problem),
        origin_section(result, problem, file),
    ]


def condition_section(result: Result, problem: Problem, picture: bool = True) -> Section:
    """Condition numbers per motion as a chart and tables, and the singular values."""
    shown = (posture_chart(problem, result.motions[0]),) if picture else ()
    blocks: list[Block] = [
        Charts((*shown, condition_chart(result), spectrum_chart(result, problem))),
        motion_table(result.motions),
        pairs_of_numbers_table(result.motions, result.random) if result.random else _NO_BASELINE,
        *(f"Motion {motion.index}: {motion.note}." for motion in result.motions if motion.note),
    ]
    lead = f"{condition_words(result)}{_weighting_words(result, problem)}"
    return Section("condition", "Condition numbers", tuple(blocks), lead)


def result_figures(result: Result, problem: Problem) -> list[KeyFigure]:
    """What is best after all motions, the random motions', how many, and what is proved."""
    last, count = _figure(result.motions[-1]), counted(len(result.motions), "motion")
    prior = ", on earlier data" if result.priors else ""
    for_work = result.motions[-1].predicted_deviation is not None
    name = "predicted torques, in noise of a sample" if for_work else "condition number"
    found = [KeyFigure(name, in_figures(last), f"after {count}{prior}", anchor="condition")]
    if result.random:
        random = _figure(result.random[-1])
        worse = f"{in_figures(random / last)} times worse"
        found.append(KeyFigure("best random motions", in_figures(random), worse))
    seconds = in_figures(sum(motion.seconds for motion in result.motions))
    duration = in_figures(problem.trajectory.duration)
    motions = f"{len(result.motions)} × {duration} s"
    found.append(KeyFigure("motions", motions, f"found in {seconds} s", anchor="motions"))
    (value, remark), words = _kept(result)
    verdicts: dict[str, Verdict] = {"good": "good", "bad": "bad"}
    verdict = verdicts.get(words.kind, "open")
    kept = KeyFigure("constraints", value, remark, verdict, "margins")
    return [*found, *([kept] if problem.constraints else [])]


def result_answer(result: Result) -> Text:
    """What the page of motions says first."""
    words = _kept(result)[1]
    kind = "bad" if words.kind == "bad" else "answer"
    return Text(f"{condition_words(result)} {words.text}", kind)


def _figure(motion: Motion | RandomMotion) -> float:
    """Predicted deviation where motions are planned for that, else the stacked condition number."""
    deviation = motion.predicted_deviation
    return motion.stacked_condition_number if deviation is None else deviation


def condition_words(result: Result) -> str:
    """The finding in one or two sentences."""
    numbers = [_figure(motion) for motion in result.motions]
    steps = " → ".join(in_figures(number) for number in numbers)
    prior = f" on top of {counted(len(result.priors), 'earlier file')}" if result.priors else ""
    if result.motions and result.motions[-1].predicted_deviation is not None:
        words = f"Torques of the work are predicted to {steps} of the noise of a sample{prior}."
    elif len(numbers) == 1:
        words = f"The motion gives a condition number of {steps}{prior}."
    else:
        words = f"Stacked motion by motion{prior}, the condition number goes {steps}."
    if result.random:
        drawn, admissible = result.random_candidates
        random = _figure(result.random[-1])
        words += (
            f" The best of {admissible} admissible random motions ({drawn} drawn), stacked the "
            f"same way, reach {in_figures(random)}: {in_figures(random / numbers[-1])} times worse."
        )
    return words


def _weighting_words(result: Result, problem: Problem) -> str:
    """What the numbers are relative to, where it is not the plain regressor of the paper."""
    weighting, effects = problem.weighting, result.effect_names
    parts: list[str] = []
    if problem.prediction is not None:  # condition numbers are those of the plain regressor
        return ""
    if weighting.row_name != "none":
        parts.append(f"rows weighted ({weighting.row_name.replace('_', ' ')})")
    if weighting.column_name != "none":
        parts.append(f"columns scaled ({weighting.column_name.replace('_', ' ')})")
    if effects:
        parts.append(f"{counted(len(effects), 'column')} of effects beside the base parameters")
    return f" Of the regressor with {', '.join(parts)}." if parts else ""


# Every motion over time.


def drawn_motions(motions: tuple[Motion, ...], charts: int) -> tuple[Motion, ...]:
    """The first motions, as many as a page can carry with so many `charts` each."""
    return motions[: max(1, _MOST_CHARTS // charts)]


def _choice(motions: tuple[Motion, ...], shown: dict[int, tuple[Block, ...]]) -> list[Block]:
    """Blocks of the motions by choice, and a sentence about motions that are left out."""
    options = tuple((f"motion {index}", blocks) for index, blocks in shown.items())
    left_out = (
        f"The first {len(shown)} of {len(motions)} motions are drawn; `excite report FILE.h5 "
        "--figures DIR` draws all."
    )
    return [*([left_out] if len(shown) < len(motions) else []), Choice("Motion", options)]


def motion_section(result: Result, problem: Problem) -> Section:
    """One card per joint, the motion by choice, and a table of peaks behind a fold."""
    joints = problem.robot.n
    shown = drawn_motions(result.motions, joints)
    cards = max(joints * len(shown), 1)
    points = int(np.clip(_ALL_POINTS // cards, _FEWEST_POINTS, _POINTS))
    drawn: dict[int, tuple[Block, ...]] = {}
    for motion in shown:
        signals = signals_of(problem, motion, points)
        drawn[motion.index] = (
            Charts(motion_cards(problem, signals, motion.index)),
            peaks_table(problem, signals),
        )
    duration = in_figures(problem.trajectory.duration)
    return Section(
        "motions",
        "Motions",
        tuple(_choice(result.motions, drawn)),
        f"{counted(len(result.motions), 'motion')} of {duration} s, {joints} joints. Shaded: "
        "beyond a limit. Speed, acceleration and (where the torque is bounded) the torque of the "
        "URDF's inertias are drawn as shares of their limits; dotted: there is no limit, share of "
        "the own peak.",
    )


def margin_section(result: Result, problem: Problem) -> Section:
    """A table of the worst margins, and every margin over time, the motion by choice."""
    if not problem.constraints:
        none = "The problem has no constraints, so there is nothing to keep away from."
        return Section("margins", "Margins", (none,))
    drawn: dict[int, tuple[Block, ...]] = {
        motion.index: (Charts(tuple(margin_charts(problem, motion).values())),)
        for motion in drawn_motions(result.motions, len(problem.constraints))
    }
    blocks = (
        _kept(result)[1],
        margin_table(result.motions, Detail.PAGE),
        *_pairs(problem),
        *_choice(result.motions, drawn),
    )
    lead = (
        "A margin is what is left beyond what the config asks to keep. Shaded: forbidden; the dot "
        "is the worst instant."
    )
    return Section("margins", "Margins", blocks, lead)


def _kept(result: Result) -> tuple[tuple[str, str], Text]:
    """How constraints are kept: in two words each, and as a sentence."""
    proved = {
        f"{name} (motion {motion.index})": each
        for motion in result.motions
        for name, each in motion.certified.items()
    }
    loose = [name for name, each in proved.items() if not each]
    broken = [
        f"{name} (motion {motion.index})"
        for motion in result.motions
        for name, worst in motion.margins.items()
        if worst.violations
    ]
    kept = "kept at 1 kHz"
    if broken:
        words = Text(f"Broken at controller rate: {', '.join(broken)}.", "bad")
        return (f"{len(broken)} BROKEN", "at controller rate"), words
    if doubts := "; ".join(doubts_in_words(result.motions)):
        text = f"Kept at every millisecond, but {doubts}. `excite check` judges it."
        return (kept, "not as they were proved"), Text(text, "bad")
    if not proved:
        text = (
            "Kept at every millisecond. Between these instants nothing was proved when the motions "
            "were made (optimizer.certify: false); `excite check CONFIG FILE.h5` does."
        )
        return (kept, "not proved between instants"), Text(text)
    if loose:
        text = (
            f"Kept at every millisecond; not proved between: {', '.join(loose)}. "
            "`excite check CONFIG FILE.h5` says why."
        )
        few = f"{len(proved) - len(loose)} of {len(proved)} proved"
        return (few, "the others kept at 1 kHz"), Text(text, "bad")
    text = "Every constraint of every motion is proved to hold at every instant."
    return ("all proved", "at every instant of every motion"), Text(text, "good")


def _pairs(problem: Problem) -> list[Block]:
    """How many pairs of bodies the verdicts speak of, and all that they do not speak of."""
    rows = tuple(
        (f"{pair.first} – {pair.second}", reason_in_words(pair.reason))
        for pair in unjudged(problem)
    )
    names = ("pair", "why")
    table = Table("Link pairs that are not checked", names, rows, words=names)
    return [
        *(Text(words, "bad") for words in unguarded_in_words(problem)),
        *counted_pairs(problem),
        not_modelled_in_words(problem),
        *([table] if rows else []),
    ]


# Where a result comes from: config, seed, robot, versions, earlier data, times.


def origin_section(result: Result, problem: Problem, file: str) -> Section:
    """What one needs to make the result again, and what was watched."""
    columns, versions = ("what", "value"), ("library", "version")
    rows = tuple(sorted(result.versions.items()))
    blocks: list[Block] = [
        Table("This result", columns, (("file", file), *_origin(result, problem)), left=columns),
        Fold("The config, with all defaults (YAML)", (Text(result.config, "code"),)),
        *(
            [Fold("Columns of effects", (", ".join(names),))]
            if (names := result.effect_names)
            else []
        ),
        Table("Versions", versions, rows, left=versions, folded=True),
    ]
    if result.checked_pairs:
        title = (
            f"{counted(len(result.checked_pairs), 'pair')} checked, "
            f"{len(result.dropped_pairs)} not checked"
        )
        kinds = {"checked": result.checked_pairs, "not checked, and why": result.dropped_pairs}
        tables = (
            Table("", (name,), tuple((pair,) for pair in pairs), left=(name,))
            for name, pairs in kinds.items()
            if pairs
        )
        blocks.append(Fold(title, tuple(tables)))
    if left_out := problem.extension.left_out:
        blocks.append(f"Effects that the regressor leaves out: {'; '.join(left_out)}.")
    lead = (
        "Made by `excite optimize`. "
        f"Minimised: {problem.spec.criterion.kind.replace('_', ' ')} of {problem.columns} columns, "
        f"{problem.variables} coefficients per motion, {len(problem.constraints)} kinds of "
        "constraints. The same config, seed and versions give the same numbers."
    )
    return Section("config", "How it was made", tuple(blocks), lead)


def _origin(result: Result, problem: Problem) -> tuple[tuple[str, str], ...]:
    robot, trajectory = problem.robot, problem.trajectory
    seconds = sum(motion.seconds for motion in result.motions)
    evaluations = sum(motion.evaluations for motion in result.motions)
    base = "floating base that stands still" if robot.floating else "fixed base"
    return (
        ("robot", f"{robot.name}, {robot.n} moved joints, {base}"),
        ("URDF", problem.spec.robot.urdf),
        ("robot hash", result.fingerprint),
        ("measured rows", str(len(robot.rows))),
        ("base parameters", str(problem.base.rank)),
        ("columns of effects", _kinds(result.effect_names)),
        ("trajectory", f"{problem.spec.trajectory.family}, {in_figures(trajectory.duration)} s"),
        ("seed", str(result.seed)),
        ("earlier data", ", ".join(result.priors) or "none"),
        ("computation time", f"{seconds:.1f} s, {counted(evaluations, 'evaluation')}"),
    )


def _kinds(names: Sequence[str]) -> str:
    """`12: viscous_friction, ripple` of columns as `ripple[elbow].sin`."""
    kinds = dict.fromkeys(name.partition("[")[0] for name in names)
    return f"{len(names)}: {', '.join(kinds)}" if names else "none"
