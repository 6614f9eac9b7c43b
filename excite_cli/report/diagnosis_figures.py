"""Figures of a diagnosis as files: torque before and after, errors, and the evidence."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import by_worth
from excite_cli.report.diagnosis_sections import torque_units
from excite_cli.report.effect_section import effect_plots, friction_plots
from excite_cli.report.plot import Plot
from excite_cli.report.plot_figure import draw_plots
from excite_cli.report.residual_error_figure import draw_errors
from excite_cli.report.residual_error_section import by_joint
from excite_cli.report.residual_section import plots_in_time

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CARDS = 9  # of a figure


def figures_of(found: Diagnosis) -> dict[str, Callable[[], "Figure"]]:
    """What draws each figure, by its name, in reading order; without samples the errors alone.

    `before_RUN` and `after_RUN` are of runs that hold held-out data.
    """
    units = torque_units(found)
    figures: dict[str, Callable[[], Figure]] = {}
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
    figures["errors"] = partial(
        draw_errors, f"Errors on held-out data: {found.held_out_run}", ("before", "after"),
        (found.before, found.after), by_joint(found.joint_names, units), found.noise_floor,
    )  # fmt: skip
    if found.traces is not None:
        friction = friction_plots(found, found.traces)
        if friction:
            figures["friction"] = partial(
                draw_plots, "All friction of a joint together", friction, 3
            )
        large, _ = by_worth(found.effects, found)
        cards = effect_plots(found, found.traces, large)
        for number, part in enumerate(_parts(cards), 1):
            title = "Partial residuals and the fitted laws"
            figures[f"effects_{number}"] = partial(draw_plots, title, part, 3)
    return figures


def _parts(plots: Sequence[Plot]) -> list[tuple[Plot, ...]]:
    return [tuple(plots[k : k + _CARDS]) for k in range(0, len(plots), _CARDS)]
