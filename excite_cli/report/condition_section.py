"""How well the parameters can be seen after each motion, beside the best of random motions."""

from collections.abc import Iterable, Sequence

import numpy as np

from excite_cli.excitation.motion import Motion
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.report.campaign import Campaign, counted, in_figures
from excite_cli.report.chart import Colour
from excite_cli.report.page import Block, Charts, KeyFigure, Section, Table, Text
from excite_cli.report.plot import Panel, Plot, Series
from excite_cli.report.posture_chart import posture_chart
from excite_cli.report.spectrum_chart import spectrum_chart

_HEIGHT = 200  # px
_NO_BASELINE = (
    "This file holds no random motions to compare with. `excite compare-random CONFIG --optimized "
    "FILE.h5 -o BOTH.h5` draws them under the same constraints and stores both."
)


def condition_section(campaign: Campaign, picture: bool = True) -> Section:
    """Condition numbers per motion as a chart and a table, and the singular values.

    With a `picture` the robot stands beside them, where it is nearest to something.
    """
    result = campaign.result
    shown = (posture_chart(campaign),) if picture else ()
    blocks: list[Block] = [
        Charts((*shown, condition_chart(result), spectrum_chart(result, campaign.problem))),
        condition_table(result),
    ]
    if not result.random:
        blocks.append(Text(_NO_BASELINE))
    return Section(
        campaign.anchor("condition"),
        campaign.titled("Condition numbers"),
        tuple(blocks),
        f"{condition_words(result)}{_weighting_words(campaign)}",
    )


def condition_figures(campaign: Campaign) -> tuple[KeyFigure, ...]:
    """Condition number after all motions, the random motions' and how many motions there are."""
    result, last = campaign.result, campaign.result.motions[-1]
    of = "" if campaign.alone else f", {campaign.name}"
    prior = ", on earlier data" if result.priors else ""
    found = [
        KeyFigure(
            f"condition number{of}",
            in_figures(last.stacked_condition_number),
            f"after {campaign.motions}{prior}",
        )
    ]
    if result.random:
        random = result.random[-1].stacked_condition_number
        found.append(
            KeyFigure(
                f"best random motions{of}",
                in_figures(random),
                f"{in_figures(random / last.stacked_condition_number)} times worse",
            )
        )
    seconds = sum(motion.seconds for motion in result.motions)
    duration = campaign.problem.trajectory.duration
    found.append(
        KeyFigure(
            f"motions{of}",
            f"{len(result.motions)} × {in_figures(duration)} s",
            f"found in {in_figures(seconds)} s",
        )
    )
    return tuple(found)


def condition_words(result: Result) -> str:
    """The finding in one or two sentences."""
    numbers = [motion.stacked_condition_number for motion in result.motions]
    steps = " → ".join(in_figures(number) for number in numbers)
    prior = f" on top of {counted(len(result.priors), 'earlier file')}" if result.priors else ""
    if len(numbers) == 1:
        words = f"The motion gives a condition number of {steps}{prior}."
    else:
        words = f"Stacked motion by motion{prior}, the condition number goes {steps}."
    if result.random:
        drawn, admissible = result.random_candidates
        random = result.random[-1].stacked_condition_number
        words += (
            f" The best of {admissible} admissible random motions ({drawn} drawn), stacked the "
            f"same way, reach {in_figures(random)}: {in_figures(random / numbers[-1])} times worse."
        )
    return words


def _weighting_words(campaign: Campaign) -> str:
    """What the numbers are relative to, where it is not the plain regressor of the paper."""
    weighting, effects = campaign.problem.weighting, campaign.result.effect_names
    parts = []
    if weighting.row_name != "none":
        parts.append(f"rows weighted ({weighting.row_name.replace('_', ' ')})")
    if weighting.column_name != "none":
        parts.append(f"columns scaled ({weighting.column_name.replace('_', ' ')})")
    if effects:
        parts.append(f"{counted(len(effects), 'column')} of effects beside the base parameters")
    return f" Of the regressor with {', '.join(parts)}." if parts else ""


def condition_chart(result: Result) -> Plot:
    """Own and stacked condition number of every motion on a logarithmic axis."""
    parts: list[tuple[str, Colour, Sequence[Motion] | Sequence[RandomMotion]]] = [
        ("optimised", "blue", result.motions)
    ]
    if result.random:
        parts.append(("random", "vermilion", result.random))
    indices = sorted({motion.index for _, _, motions in parts for motion in motions})
    at = {index: k for k, index in enumerate(indices)}
    series = []
    for word, colour, motions in parts:
        alone, stacked = np.full((2, len(at)), np.nan)
        for motion in motions:
            alone[at[motion.index]] = motion.condition_number
            stacked[at[motion.index]] = motion.stacked_condition_number
        alone, stacked = (np.where(np.isfinite(each), each, np.nan) for each in (alone, stacked))
        series.append(Series(f"{word}, alone", alone, colour, "rings"))
        series.append(Series(f"{word}, stacked", stacked, colour, "joined"))
    said = "; ".join(
        f"{word}: stacked {_listed(m.stacked_condition_number for m in motions)}, alone "
        f"{_listed(m.condition_number for m in motions)}"
        for word, _, motions in parts
    )
    return Plot(
        "Condition number after each motion",
        f"Condition numbers by motion, {said}.",
        "motion [–]",
        np.array(indices, dtype=float),
        (Panel("condition number [–]", tuple(series), height=_HEIGHT, logarithmic=True),),
        caption="Filled: with all motions before stacked. Open: the motion alone.",
        span=(indices[0] - 0.5, indices[-1] + 0.5),
        counted=True,
    )


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(in_figures(number) for number in numbers)


def condition_table(result: Result) -> Table:
    """Every motion with its condition numbers, how the search ended and what it took."""
    random = {motion.index: motion for motion in result.random}
    columns = ["motion", "alone", "stacked"]
    columns += ["random alone", "random stacked", "times worse"] if random else []
    rows = []
    for motion in result.motions:
        row = [str(motion.index), in_figures(motion.condition_number)]
        row.append(in_figures(motion.stacked_condition_number))
        if random:
            row += _beside(motion, random.get(motion.index))
        status = motion.status if motion.improved else f"{motion.status}; no improvement"
        row += [status, str(motion.iterations), f"{motion.seconds:.1f}"]
        rows.append(tuple(row))
    notes = [f"Motion {m.index}: {m.note}." for m in result.motions if m.note]
    count = len(columns)
    return Table(
        (*columns, "search ended", "iterations", "time [s]"),
        tuple(rows),
        title="Motions",
        right=frozenset({*range(count), count + 1, count + 2}),
        note=" ".join(notes),
    )


def _beside(motion: Motion, random: RandomMotion | None) -> list[str]:
    if random is None:
        return ["–", "–", "–"]
    ratio = random.stacked_condition_number / motion.stacked_condition_number
    numbers = (random.condition_number, random.stacked_condition_number, ratio)
    return [in_figures(number) for number in numbers]
