"""The evidence of every effect that a diagnosis found, as cards; small ones are folded."""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.traces import EffectTrace, Traces
from excite_cli.diagnosis.words import (
    SMALL_PART,
    approximation_in_words,
    by_worth,
    counted,
    held_out_in_words,
    p_in_words,
    place_in_words,
    title_of,
    value_in_words,
)
from excite_cli.effects.base import Effect, Picture
from excite_cli.effects.catalogue import catalogue
from excite_cli.report.effect_chart import Cloud, cloud_of, cloud_plot, together, window_plot
from excite_cli.report.plot import Plot
from excite_cli.shown.answer import Block, Charts, Detail, Fold, Section
from excite_cli.summary.named_effects import joint_alias_in_words, other_names


def evidence_section(found: Diagnosis, detail: Detail) -> Section:
    """Cards on a page."""
    blocks = _cards(found) if detail == Detail.PAGE else ()
    lead = (
        "Partial residual: the measured torque of the training data less all other terms of the "
        "model, over the quantity that the effect is a function of. If the effect is present, the "
        "medians (blue, with the middle 80 % of the samples) follow the fitted law; otherwise the "
        "medians lie about zero. Samples in which the joint stands or reverses are left "
        "out, as in the fit."
    )
    return Section("diagnosis-evidence", "Evidence", blocks, lead, on_paper=False)


def _cards(found: Diagnosis) -> tuple[Block, ...]:
    if found.traces is None or not found.effects:
        return ()
    large, small = by_worth(found.effects, found)
    groups = (
        Charts(friction_plots(found, found.traces), "The parts of a joint's friction together"),
        Charts(effect_plots(found, found.traces, large), "One by one, the largest first"),
    )
    blocks: list[Block] = [group for group in groups if group.charts]
    if small:
        cards = Charts(effect_plots(found, found.traces, small))
        what = counted(len(small), "small effect")
        text = f"{what} (each below {SMALL_PART:.0%} of the error reduction)"
        blocks.append(Fold(text, (cards,)) if large else cards)
    return tuple(blocks)


def effect_plots(
    found: Diagnosis, traces: Traces, effects: Sequence[NamedEffect]
) -> tuple[Plot, ...]:
    """The evidence of each of the effects that has samples to draw."""
    units = dict(zip(found.joint_names, traces.torque_units, strict=True))
    charts: list[Plot] = []
    for named in effects:
        trace = _trace_of(named, traces)
        if trace is None:
            continue
        place = place_in_words(named.effect, len(found.joint_names))
        title = f"{title_of(named.effect.kind)}: {place}"
        for row, joint in enumerate(trace.rows):
            cloud = cloud_of(trace, row, units[joint])
            if not len(cloud.x):
                continue
            shown = (
                title if trace.rows == named.effect.joints[:1] else f"{title}; torque of {joint}"
            )
            caption = _caption(found, named) if not row else ""
            chart = None
            if _picture(trace) == "window" and np.ptp(cloud.law) > 0:
                chart = window_plot(shown, trace, row, units[joint], caption)
            charts.append(cloud_plot(shown, cloud, caption) if chart is None else chart)
        if not trace.quantity:
            window = window_plot(f"{title}; {trace.rows[0]} in time", trace, 0,
                                 units[trace.rows[0]])  # fmt: skip
            charts += [window] if window is not None else []
    return tuple(charts)


def _trace_of(named: NamedEffect, traces: Traces) -> EffectTrace | None:
    record = named.effect
    key = (record.kind, record.joints, record.runs, record.covariate)
    return next((t for t in traces.effects if (t.kind, t.joints, t.runs, t.covariate) == key), None)


def _caption(found: Diagnosis, named: NamedEffect) -> str:
    values = "; ".join(value_in_words(name, value) for name, value in named.parameters.items())
    said = [
        values,
        f"p {p_in_words(named.p_value, named.least_p)}; explains {named.share_of_residual:.2%} of "
        f"the residual; lowers the cross-validation error by {named.gain:.1%}",
    ]
    if told := held_out_in_words(named):
        said.append(f"Held-out, without it: {told}")
    everything = len(found.joint_names)
    own = (named.effect.kind, named.effect.joints, named.effect.runs)
    said += other_names(named, everything)
    said += [
        joint_alias_in_words(alias, everything)
        for alias in found.joint_aliases
        if own in [(each.kind, each.joints, each.runs) for each in alias.named]
    ]
    if named.approximates:
        form = approximation_in_words(named.approximates)
        said.append(f"A surrogate term; likely true form: {form}")
    return "".join(f"{each}. " for each in said).rstrip()


def _picture(trace: EffectTrace) -> Picture:
    kind = catalogue().get(trace.kind)
    return "cloud" if kind is None else kind.picture


def _over_speed(trace: EffectTrace) -> bool:
    kind = catalogue().get(trace.kind)
    if kind is None or kind.abscissa is not Effect.abscissa:
        return False
    return kind.function_of == ("speed",) and kind.scope == "joint"


def friction_plots(found: Diagnosis, traces: Traces) -> tuple[Plot, ...]:
    """For each joint with several effects over its speed: all of them at once."""
    clouds = friction_clouds(found, traces, fewest=2)
    return tuple(cloud_plot(f"Friction of {joint}", *both) for joint, both in clouds.items())


def friction_clouds(
    found: Diagnosis, traces: Traces | None, fewest: int = 1
) -> dict[str, tuple[Cloud, str]]:
    """By the joint, `fewest` or more effects over its speed as one, and their kinds."""
    clouds = {}
    for joint, unit in zip(found.joint_names, found.torque_units, strict=True):
        every = traces.effects if traces else ()
        parts = [t for t in every if _over_speed(t) and t.rows == (joint,) and not t.runs]
        parts = parts if parts and _same_samples(parts) else parts[:1]
        if len(parts) >= fewest and np.isfinite(parts[0].partial).any():
            own = together([cloud_of(trace, 0, unit) for trace in parts])
            clouds[joint] = own, f"{', '.join(trace.kind for trace in parts)}."
    return clouds


def _same_samples(parts: Sequence[EffectTrace]) -> bool:
    first = parts[0]
    return all(
        np.array_equal(first.t, each.t)
        and np.array_equal(first.part, each.part)
        and np.array_equal(np.isfinite(first.partial), np.isfinite(each.partial))
        for each in parts[1:]
    )
