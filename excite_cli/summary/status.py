"""What sums a diagnosis up, in three figures: the error, what was found, what to do next."""

from math import isnan

from excite_cli.diagnosis.next_motion import next_experiment
from excite_cli.diagnosis.records import OPEN_SETUP, Diagnosis, NamedEffect
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.diagnosis.words import by_worth, counted, no_gain_in_words, value_in_words
from excite_cli.shown.answer import KeyFigure, Verdict
from excite_cli.summary.cells import percent
from excite_cli.summary.named_effects import what_and_where

_MOST = 3  # joints and effects that are told by name


def diagnosis_figures(found: Diagnosis) -> tuple[KeyFigure, ...]:
    """What sums a diagnosis up; each leads to the section that says more."""
    return _error(found), _effects(found), _next(found)


def _error(found: Diagnosis) -> KeyFigure:
    if not found.good:
        value, why = "the held-out error did not fall", no_gain_in_words(found)
        return KeyFigure("verdict", value, why, "bad", "diagnosis-errors")
    before, after = found.before.mean_relative_moving, found.after.mean_relative_moving
    low, high = found.after.interval
    known = {j: each for j, each in found.after.relative_moving.items() if not isnan(each)}
    said = []
    if known:
        worst = max(known, key=lambda joint: known[joint])
        said.append(f"worst joint: {worst} {known[worst]:.2%}")
    if found.textbook is not None:
        said.append(f"textbook friction: {percent(found.textbook.error.mean_relative_moving)}")
    said.append(
        f"all samples {found.after.mean_relative:.2%}, 95% interval {low:.2%} to {high:.2%}"
    )
    return KeyFigure(
        "error on held-out data, moving",
        f"{before:.2%} → {after:.2%}",
        "\n".join(said),
        "open" if found.joints_with_residual else "good",
        "diagnosis-errors",
    )


def _effects(found: Diagnosis) -> KeyFigure:
    name, anchor = "effects found", "diagnosis-found"
    if not found.named:
        none = "nothing is missing" if found.complete else "unexplained residual"
        return KeyFigure(name, "0", none, "good" if found.complete else "open", anchor)
    ranked = [each for part in by_worth(found.named, found) for each in part]
    said = [_sized(each, found) for each in ranked[:_MOST]]
    sure = sum(each.verdict is HeldOutVerdict.CONFIRMED for each in found.named)
    alike = sum(bool(each.aliases) for each in found.effects)
    harmful = any(each.verdict is HeldOutVerdict.HARMFUL for each in found.named)
    told = f"{sure} confirmed on held-out data, "
    told += f"{alike} with indistinguishable alternatives" if alike else "every effect is unique"
    verdict: Verdict = "bad" if harmful else "open" if alike or sure < len(found.named) else "good"
    return KeyFigure(name, str(len(found.named)), "\n".join((*said, told)), verdict, anchor)


def _sized(named: NamedEffect, found: Diagnosis) -> str:
    (name, value), *_ = named.parameters.items()
    size = value_in_words(name, value).removeprefix(f"{name} ")
    return f"{what_and_where(named.effect, len(found.joint_names))}: {size}"


def _next(found: Diagnosis) -> KeyFigure:
    warned = [each for each in found.findings if each.severity == "warning"]
    left = found.joints_with_residual
    doubtful = set_up_is_open(found)
    value, anchor = "plan a motion", "diagnosis-next"
    said = [f"to {purpose(found)}"]
    if doubtful:
        value, anchor, said = "resolve the set-up", "diagnosis-data", ["with excite inspect"]
    elif found.complete:
        value, said = "score other data", []
    if left:
        more = " …" if len(left) > _MOST else ""
        said.append(
            f"unexplained on {counted(len(left), 'joint')}: {', '.join(left[:_MOST])}{more}"
        )
    else:
        said.append("the residual behaves like noise")
    kinds = ", ".join(dict.fromkeys(each.kind.replace("_", " ") for each in warned))
    data = f" ({kinds}): see Data and choices" if warned else ": taken as recorded"
    said.append(f"{counted(len(warned), 'warning')} about the data{data}")
    doubts = left or warned or any(each.aliases for each in found.effects)
    verdict: Verdict = "bad" if doubtful or not found.good else "open" if doubts else "good"
    return KeyFigure("what next", value, "\n".join(said), verdict, anchor)


def set_up_is_open(found: Diagnosis) -> bool:
    """Whether the set-up is in doubt, which comes before all else."""
    return any(each.kind == OPEN_SETUP for each in found.findings)


def purpose(found: Diagnosis) -> str:
    """What the next motion is for, after `to`."""
    experiment = next_experiment(found)
    if experiment["purpose"] == "separate":
        return f"distinguish {counted(len(experiment['pairs']), 'pair')} of effects"
    if not found.effects:
        return "show more of what no effect explains"
    effects = counted(len(found.effects), "effect")
    return f"determine the extended model ({effects}) more exactly"
