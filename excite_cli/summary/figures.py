"""Figures of motions and diagnoses as files: the charts of their pages, on paper."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import by_worth
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.report.condition_chart import condition_chart, spectrum_chart
from excite_cli.report.error_chart import DECLARED_AND_FOUND, error_charts
from excite_cli.report.motion_chart import margin_charts, motion_cards, signals_of
from excite_cli.report.plot_figure import draw_plots, draw_rows
from excite_cli.report.residual_chart import plots_in_time
from excite_cli.summary.effect_evidence import effect_plots, friction_plots

# What draws a figure of matplotlib, by the name of its file.
Figures = dict[str, Callable[[], Any]]
_CARDS = 9  # of a figure
_POINTS = 600  # of a motion


def result_figures(result: Result, problem: Problem) -> Figures:
    """What draws each figure of motions, by its name, in reading order."""
    figures: Figures = {
        "condition_numbers": lambda: draw_plots(_drawn(result), [condition_chart(result)], 1),
        "spectrum": lambda: draw_plots(problem.robot.name, [spectrum_chart(result, problem)], 1),
    }
    watched = [constraint.name for constraint in problem.constraints if constraint.linear is None]
    for motion in result.motions:
        figures[f"motion_{motion.index}"] = partial(_draw_motion, motion, problem)
        if watched:
            figures[f"margins_{motion.index}"] = partial(_draw_margins, motion, problem, watched)
    return figures


def _drawn(result: Result) -> str:
    drawn, admissible = result.random_candidates
    random = f"; random: the best of {admissible} admissible out of {drawn} drawn"
    return "Condition numbers" + random * bool(result.random)


def _draw_motion(motion: Motion, problem: Problem) -> Any:
    cards = motion_cards(problem, signals_of(problem, motion, _POINTS), motion.index)
    title = (
        f"{problem.robot.name}, motion {motion.index}: condition number "
        f"{motion.condition_number:.2f} alone, {motion.stacked_condition_number:.2f} stacked"
    )
    return draw_plots(title, cards, 2 if len(cards) in (2, 4) else min(len(cards), 3))


def _draw_margins(motion: Motion, problem: Problem, watched: list[str]) -> Any:
    """Of constraints other than the bounds of single joints."""
    charts = margin_charts(problem, motion)
    plots = [replace(charts[name], title=f"{charts[name].title}. {charts[name].caption}")
             for name in watched]  # fmt: skip
    title = f"{problem.robot.name}, motion {motion.index}: margins of the constraints"
    return draw_plots(title, plots, 1)


def diagnosis_figures(found: Diagnosis) -> Figures:
    """What draws each figure, by its name, in reading order; without samples the errors alone.

    `before_RUN` and `after_RUN` are of runs that hold held-out data.
    """
    units = found.torque_units
    figures: Figures = {}
    training = found.traces.runs if found.traces is not None else ()
    runs = dict.fromkeys(trace.run for trace in found.held_out_traces)
    traces = [each for each in (*found.held_out_traces, *training) if each.run in runs]
    alone = [replace(each, predicted=each.before, before=None)
             for each in traces if each.before is not None]  # fmt: skip
    for name, title, parts in (
        ("before", "the declared model", alone),
        ("after", "the model with the effects found", traces),
    ):
        plots = plots_in_time(parts, found.joint_names, units)
        labels = dict(zip(dict.fromkeys(trace.run for trace in parts), plots, strict=True))
        figures |= {
            f"{name}_{run}": partial(draw_plots, f"{label}: measured, and {title}", plots[label], 2)
            for run, label in labels.items()
        }
    errors = error_charts(
        DECLARED_AND_FOUND,
        (found.before, found.after),
        dict(zip(found.joint_names, units, strict=True)),
        found.noise_floor,
    )
    title = f"Errors on held-out data: {found.held_out_run}"
    figures["errors"] = partial(draw_rows, title, errors)
    if found.traces is None:
        return figures
    if friction := friction_plots(found, found.traces):
        figures["friction"] = partial(draw_plots, "All friction of a joint together", friction, 3)
    large, _ = by_worth(found.effects, found)
    cards = effect_plots(found, found.traces, large)
    for number, first in enumerate(range(0, len(cards), _CARDS), 1):
        title, part = "Partial residuals and the fitted laws", cards[first : first + _CARDS]
        figures[f"effects_{number}"] = partial(draw_plots, title, part, 3)
    return figures
