"""The evidence of every effect that a diagnosis found, as cards; small ones are folded."""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.records import Diagnosis, JointAlias, NamedEffect
from excite_cli.diagnosis.traces import EffectTrace, Traces
from excite_cli.diagnosis.words import (
    SMALL_PART,
    approximation_in_words,
    by_worth,
    counted,
    covariate_in_words,
    held_out_in_words,
    p_in_words,
    place_in_words,
    title_of,
    value_in_words,
)
from excite_cli.effects.base import Effect, Picture
from excite_cli.effects.catalogue import catalogue
from excite_cli.report.effect_chart import Cloud, cloud_of, cloud_plot, together, window_plot
from excite_cli.report.page import Block, Charts, Fold, PageSection, Text
from excite_cli.report.plot import Plot


def effect_section(found: Diagnosis) -> PageSection | None:
    """The section, or None if nothing was found."""
    if not found.effects:
        return None
    if found.traces is None:
        old = Text(
            "The file holds no samples to draw: it was written by an earlier version. Run "
            "`excite diagnose` again to have the pictures."
        )
        return PageSection("diagnosis-evidence", "Evidence", (old,))
    large, small = by_worth(found.effects, found)
    blocks: list[Block] = []
    whole = friction_plots(found, found.traces)
    if whole:
        blocks.append(Charts(whole, "The parts of a joint's friction together"))
    if large:
        blocks.append(
            Charts(effect_plots(found, found.traces, large), "One by one, the largest first")
        )
    if small:
        cards = effect_plots(found, found.traces, small)
        what = counted(len(small), "small effect")
        text = f"{what} (each below {SMALL_PART:.0%} of the error reduction)"
        blocks.append(Fold(text, (Charts(cards),)) if large else Charts(cards))
    lead = (
        "Partial residual: the measured torque of the training data less all other terms of the "
        "model, over the quantity that the effect is a function of. If the effect is present, the "
        "medians (blue, with the middle 80 % of the samples) follow the fitted law; otherwise the "
        "medians lie about zero. Samples in which the joint stands or reverses are left "
        "out, as in the fit."
    )
    return PageSection("diagnosis-evidence", "Evidence", tuple(blocks), lead)


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
        title = f"{_capital(title_of(named.effect.kind))}: {place}"
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


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _caption(found: Diagnosis, named: NamedEffect) -> str:
    values = "; ".join(value_in_words(name, value) for name, value in named.parameters.items())
    text = (
        f"{values}. p {p_in_words(named.p_value, named.least_p)}; explains "
        f"{named.share_of_residual:.2%} of the residual; "
        f"lowers the cross-validation error by {named.gain:.1%}."
    )
    if told := held_out_in_words(named):
        text += f" Held-out, without it: {told}."
    everything = len(found.joint_names)
    if named.aliases:
        others = [f"{title_of(a.kind)} on {place_in_words(a, everything)}" for a in named.aliases]
        text += f" These data cannot distinguish it from: {', '.join(others)}."
    for alias in found.joint_aliases:
        text += _jointly(named, alias, everything)
    if named.approximates:
        what = approximation_in_words(named.approximates, covariate_in_words)
        text += f" A surrogate term; likely true form: {what}."
    return text


def _jointly(named: NamedEffect, alias: JointAlias, everything: int) -> str:
    """What these data cannot tell from it and another, or from it where that is a pair."""
    own = (named.effect.kind, named.effect.joints, named.effect.runs)
    beside = [each for each in alias.named if (each.kind, each.joints, each.runs) != own]
    if len(beside) == len(alias.named):
        return ""
    others, company = (
        " with ".join(f"{title_of(a.kind)} on {place_in_words(a, everything)}" for a in side)
        for side in (alias.others, beside)
    )
    whole = f"it{f' with {company}' if company else ''}"
    if alias.same_torque:
        same = f" {whole.capitalize()} is the same torque as {others}"
        return f"{same}: no motion distinguishes them."
    return f" These data cannot distinguish {whole} from: {others}."


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
    units = dict(zip(found.joint_names, traces.torque_units, strict=True))
    charts = []
    for joint in found.joint_names:
        parts = [
            trace
            for trace in traces.effects
            if _over_speed(trace) and trace.rows == (joint,) and not trace.runs
        ]
        if len(parts) < 2 or not _same_samples(parts):
            continue
        clouds: list[Cloud] = [cloud_of(trace, 0, units[joint]) for trace in parts]
        names = ", ".join(title_of(trace.kind) for trace in parts)
        charts.append(cloud_plot(f"Friction of {joint}", together(clouds), f"{names}."))
    return tuple(charts)


def _same_samples(parts: Sequence[EffectTrace]) -> bool:
    first = parts[0]
    return all(
        np.array_equal(first.t, each.t)
        and np.array_equal(first.part, each.part)
        and np.array_equal(np.isfinite(first.partial), np.isfinite(each.partial))
        for each in parts[1:]
    )
