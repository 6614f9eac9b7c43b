"""How well the parameters can be seen after each motion, beside the best of random motions."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.constraints.drawing import NearestBodies
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.nearest import closest_time, nearest_bodies
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.excitation.result import Result
from excite_cli.geometry.link_meshes import Poses
from excite_cli.geometry.obstacles import Box
from excite_cli.report.campaign import RebuiltResult, counted, in_figures
from excite_cli.report.chart import Chart, Colour, side_view
from excite_cli.report.page import Block, Charts, KeyFigure, PageSection, TableBlock, Text
from excite_cli.report.plot import Curve, Panel, Plot
from excite_cli.report.spectrum_chart import spectrum_chart
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment

# The robot at the instant of a motion at which it comes nearest to something, as its capsules.
#
# Seen from afar a capsule is a thick line with round ends, so that the drawing is a few lines of
# SVG in the page's own colours, needs no mesh and shows what the constraints see.

_WIDTH, _POSTURE_HEIGHT, _MARGIN = 284.0, 210.0, 8.0  # pt
_THIN = 0.012  # [m] radius of a line between joints, where there are no capsules
_EDGES = [(i, j) for i in range(8) for j in range(i) if (i ^ j).bit_count() == 1]


@dataclass(frozen=True)
class _Stick:
    start: Array
    end: Array
    radius: float
    near: bool = False


def posture_chart(campaign: RebuiltResult) -> Chart:
    """The robot of `campaign` where its first motion has least room."""
    problem, motion = campaign.problem, campaign.result.motions[0]
    segment = Segment("", problem.trajectory, motion.coefficients)
    at = closest_time(problem, segment)
    states = States(
        problem.kinematics, *problem.trajectory.states(np.array([at]), motion.coefficients)
    )
    poses = Poses.of(problem.robot, states.q)
    margins = [constraint.margins(states) for constraint in problem.constraints]
    near = nearest_bodies(problem, poses, margins)
    name = problem.robot.name
    if near is None:
        words = f"{name} at {in_figures(at)} s of its first motion"
    else:
        words = (
            f"{name} at {in_figures(at)} s of its first motion, where it has least room; nearest: "
            f"{near.labels[0]}, distance {in_figures(1e3 * float(near.distances[0]))} mm"
        )
    capsules = " Capsules as the constraints see them." if near is not None else ""
    caption = f"{words}.{capsules} `excite view` plays all motions."
    svg = _drawn(_sticks(problem, poses, near), _boxes(problem), near)
    return Chart(f"{name} in its first motion", svg, f"{words}.", caption)


def _sticks(problem: Problem, poses: Poses, near: NearestBodies | None) -> list[_Stick]:
    """Capsules that constraints look at; where there are none, lines between the joints."""
    close = near.capsules[0] if near is not None else ()
    found = {
        id(capsule): capsule for each in problem.constraints for capsule in each.drawing.capsules
    }
    if found:
        return [
            _Stick(
                poses.points(c.joint, c.start)[0],
                poses.points(c.joint, c.end)[0],
                c.radius,
                any(c is other for other in close),
            )
            for c in found.values()
        ]
    places, parents = poses.translations[0], problem.robot.model.parents
    return [_Stick(places[parents[j]], places[j], _THIN) for j in range(1, len(places))]


def _boxes(problem: Problem) -> list[Array]:
    """Corners (8, 3) of the boxes that stand around."""
    signs = np.array([[1 if k & bit else -1 for bit in (1, 2, 4)] for k in range(8)])
    found = {
        id(each): each
        for constraint in problem.constraints
        for each in constraint.drawing.obstacles
        if isinstance(each, Box)
    }
    return [(signs * box.half) @ box.rotation.T + box.position for box in found.values()]


def _drawn(sticks: list[_Stick], boxes: list[Array], near: NearestBodies | None) -> str:
    """SVG: what is behind first; each capsule with a rim, the nearest in vermilion."""
    ends = np.array([[stick.start, stick.end] for stick in sticks])
    radii = np.array([stick.radius for stick in sticks])
    flat, depth = side_view(ends)
    reach = np.concatenate([flat - radii[:, None, None], flat + radii[:, None, None]])
    corners = [side_view(box)[0] for box in boxes]
    every = np.vstack([reach.reshape(-1, 2), *corners])
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    room = np.array([_WIDTH, _POSTURE_HEIGHT]) - 2 * _MARGIN
    scale = float((room / np.maximum(size, 1e-9)).min())
    shift = _MARGIN + (room - size * scale) / 2 - low * scale
    parts = [f'<svg viewBox="0 0 {_WIDTH:g} {_POSTURE_HEIGHT:g}">']
    for box in corners:
        placed = box * scale + shift
        parts += [_line(placed[i], placed[j], 0.8, "var(--muted)") for i, j in _EDGES]
    middle = depth.mean(axis=1)
    far, span = middle.min(), max(float(np.ptp(middle)), 1e-9)
    for k in np.argsort(middle, kind="stable"):
        one, two = flat[k] * scale + shift
        width = max(2.0 * radii[k] * scale, 1.6)
        light = 22 + 30 * (middle[k] - far) / span  # what is nearer is darker
        fill = f"color-mix(in oklab, var(--muted) {light:.0f}%, var(--card))"
        if sticks[k].near:
            fill = "color-mix(in oklab, var(--vermilion) 75%, var(--card))"
        parts.append(_line(one, two, width, "var(--muted)"))
        parts.append(_line(one, two, max(width - 1.4, 0.9), fill))
    if near is not None:
        one, two = side_view(near.ends[0])[0] * scale + shift
        parts.append(_line(one, two, 1.6, "var(--vermilion)"))
    return "".join([*parts, "</svg>"])


def _line(one: Array, two: Array, width: float, colour: str) -> str:
    return (
        f'<path d="M{one[0]:.1f} {one[1]:.1f}L{two[0]:.1f} {two[1]:.1f}" '
        f'style="stroke: {colour}; stroke-width: {width:.1f}; stroke-linecap: round"></path>'
    )


_HEIGHT = 200  # px
_NO_BASELINE = (
    "This file holds no random motions to compare with. `excite compare-random CONFIG --optimized "
    "FILE.h5 -o BOTH.h5` draws them under the same constraints and stores both."
)


def condition_section(campaign: RebuiltResult, picture: bool = True) -> PageSection:
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
    return PageSection(
        campaign.anchor("condition"),
        campaign.titled("Condition numbers"),
        tuple(blocks),
        f"{condition_words(result)}{_weighting_words(campaign)}",
    )


def condition_figures(campaign: RebuiltResult) -> tuple[KeyFigure, ...]:
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


def _weighting_words(campaign: RebuiltResult) -> str:
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
        series.append(Curve(f"{word}, alone", alone, colour, "rings"))
        series.append(Curve(f"{word}, stacked", stacked, colour, "joined"))
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


def condition_table(result: Result) -> TableBlock:
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
    return TableBlock(
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
