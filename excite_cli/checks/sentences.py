"""What checks of the set-up say: what is wrong, how sure that is, what to write in the config."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from excite_cli.checks.check_result import CheckResult, Status
from excite_cli.checks.set_up_search import SetUpMistake
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import TextbookShares
from excite_cli.checks.trust import key_of
from excite_cli.config.spec import Spec
from excite_cli.measurement.dataset import Mask

BELONG = "torques match the motion"
_MUCH = 0.4  # share of a joint's torque that is left, of which is told
_FOREIGN = 0.85  # torques of which this is left have nothing to do with the motion


def of_steps(
    steps: Sequence[SetUpMistake], declared: Setup, names: Sequence[str], spec: Spec
) -> list[CheckResult]:
    """One result for every check that has found steps, as one sentence."""
    found: dict[str, list[SetUpMistake]] = {}
    for step in steps:
        found.setdefault(step.check.name, []).append(step)
    told = {step.question for step in steps}
    return [_of_one_check(own, told, declared, names, spec) for own in found.values()]


def _of_one_check(
    steps: Sequence[SetUpMistake],
    told: set[tuple[str, tuple[int, ...], str]],
    declared: Setup,
    names: Sequence[str],
    spec: Spec,
) -> CheckResult:
    """Keys hold all that was found of one thing: a mapping is written whole.

    What was as likely, and was `told` of another step, is true as well: no word of it.
    """
    check, after = steps[0].check, steps[-1].after.setup
    before = steps[0].before if len(steps) == 1 else declared
    shown = np.any([step.concerned for step in steps], axis=0)
    shares = [_share(left, shown) for left in (steps[0].left_before, steps[-1].left_after)]
    settings = check.settings(names, spec, declared, after)
    text = check.sentence(names, before, after)
    if settings:
        text += f" (set {written(settings)})"
    text += (
        f". As configured, the URDF with any friction leaves {shares[0]:.0%} of the torques of "
        f"{_listed(names, shown)} unexplained; corrected {shares[1]:.0%}."
    )
    others = dict.fromkeys(
        f"{rival.check.sentence(names, step.before, rival.alternative.setup)}"
        + (f" ({written(more)})" if more else "")
        for step in steps
        for rival in step.rivals
        if rival.question not in told
        for more in [rival.check.settings(names, spec, declared, rival.alternative.setup)]
    )
    if others:
        text += f" As likely: {'. Or: '.join(others)}."
    joints = sorted({j for step in steps for j in step.after.joints})
    own = written(check.trusted(names, spec, joints))
    text += f" If the config is right, set {own}"
    status: Status = "fault" if any(step.is_certain for step in steps) else "doubt"
    named = joints or np.flatnonzero(shown).tolist()
    named_joints = tuple(names[j] for j in named)
    is_open = not all(step.check.has_effect(step.before, step.after.setup) for step in steps)
    return CheckResult(check.name, check.kind, status, text, named_joints, "", settings, is_open)


def _share(left: TextbookShares, shown: Mask) -> float:
    """Root mean square share of what is left: of nothing more than all can be left."""
    return min(1.0, float(np.sqrt(np.mean(np.square(left.shares[shown])))))


def no_set_up(names: Sequence[str], left: TextbookShares) -> CheckResult:
    """Another set-up explains more, and none explains enough to be taken for true."""
    off = left.judged & (left.shares > _MUCH)
    text = (
        f"the torques of {_listed(names, off)} do not fit their motion, and no set-up explains "
        f"most of them: {min(left.left, 1.0):.0%} are left with the best. Are positions too "
        "coarse, torques another channel, or is it another robot's"
    )
    joints = tuple(np.array(names)[off].tolist())
    return CheckResult(BELONG, "foreign_torque", "doubt", text, joints, is_open=True)


def unexplained(
    left: TextbookShares, names: Sequence[str], declared: Sequence[bool]
) -> list[CheckResult]:
    """Torques that do not belong to the motion, for a reason that cannot be named.

    A fault where they are those of most joints. Single joints may have effects as large: a doubt
    where the config has `declared` how they are set up, which was taken as it is.
    """
    foreign: Mask = left.judged & (left.shares > _FOREIGN)
    status: Status = "fault" if foreign.sum() >= 0.5 * left.judged.sum() else "doubt"
    if status == "doubt":
        foreign = foreign & np.array(declared)
    if not foreign.any():
        return []
    text = (
        f"the torques of {_listed(names, foreign)} do not fit their motion with any friction, and "
        "no single exchange, sign, zero, unit or mount explains it. Check the order and the signs "
        "of all columns (measurement.names, sign, position_sign), what the torque is "
        "(measurement.torque), and whether this is the robot's URDF. If the data are right as they "
        f"are, say so: {written(key_of(BELONG))}"
    )
    joints = tuple(names[j] for j in np.flatnonzero(foreign).tolist())
    return [CheckResult(BELONG, "foreign_torque", status, text, joints, is_open=True)]


def written(settings: Mapping[str, Any]) -> str:
    """`measurement.sign: {elbow: -1} and …`, as it stands in a config."""
    return " and ".join(f"{key}: {_value(value)}" for key, value in settings.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_value(x)}" for name, x in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _listed(names: Sequence[str], chosen: Mask) -> str:
    return ", ".join(names[j] for j in np.flatnonzero(chosen).tolist())
