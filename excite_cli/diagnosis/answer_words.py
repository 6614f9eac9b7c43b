"""The answer in a few sentences: what the model misses, how much stays, and what to do next.

Shares are of the fall of the error on held-out data, mean over the joints that move there: the
parts of the effects (`error_parts`) add up to it.
"""

from collections.abc import Iterable, Sequence
from math import floor, inf, isnan, log10

from excite_cli.diagnosis.records import (
    HELD_OUT_DIFFERS,
    OPEN_SETUP,
    Diagnosis,
    FrictionLine,
    NamedEffect,
    mean_of_known,
)
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.diagnosis.words import (
    counted,
    covariate_in_words,
    no_gain_in_words,
    place_in_words,
    title_of,
)
from excite_cli.effects.catalogue import catalogue, rubs, straight_friction
from excite_cli.effects.parameter import Value
from excite_cli.identification.fit_words import relative_in_words, short_number
from excite_cli.identification.torque_scale import KNOWN_LOAD

FRICTION = "friction"
INERTIAS = "inertias"
_WORTH_SAYING = 0.05  # share of the fall
_NEARLY_ALL = 0.995
_STANDS = 1e-3  # rad/s; m/s
# Of the torque, and times the textbook's error: a joint that loses less is as good as before.
_LOST, _LOST_TIMES = 0.005, 1.1
_MOST = 3  # effects beside friction that get a clause of their own
_PREFIXES = ((1e6, "M"), (1e3, "k"))


def answer_in_words(found: Diagnosis) -> str:
    """One to five sentences, from the records alone."""
    if not found.good:
        return no_gain_in_words(found)
    said = [_missing(found), *_left(found), _next(found)]
    return " ".join(sentence for sentence in said if sentence)


def shares(found: Diagnosis) -> dict[str, float]:
    """Of the fall: friction, every other kind that was found, the fit of kept inertias."""
    parts: dict[str, float] = {}
    for each in found.effects:
        group = FRICTION if _rubs(each) else each.effect.kind
        parts[group] = parts.get(group, 0.0) + each.error_reduction
    if found.inertia_parts:
        parts[INERTIAS] = mean_of_known(found.inertia_parts.values())
    fall = sum(parts.values())
    if not fall > 0.0:  # nor where parts are not known
        return {}
    ranked = sorted(parts.items(), key=lambda item: -item[1])
    return {group: part / fall for group, part in ranked}


def _rubs(named: NamedEffect) -> bool:
    kind = catalogue().get(named.effect.kind)
    return kind is not None and rubs(kind)


def _missing(found: Diagnosis) -> str:
    """What the model misses, by share; of each the place where it is most."""
    if not found.effects:
        if found.complete:
            return f"Nothing is missing: held-out error {_percent(found)} of torque RMS."
        return (
            f"No effect of the catalogue explains the residual ({_percent(found)} of torque RMS)."
        )
    if _in_vain(found):
        return (
            f"Adding {counted(len(found.effects), 'effect')} does not lower the error "
            f"where joints move ({relative_in_words(found.baseline.mean_relative_moving)} before)."
        )
    of_all = shares(found)
    said = []
    friction = of_all.get(FRICTION, 0.0)
    if friction >= _WORTH_SAYING:
        what = "nearly all of" if friction > _NEARLY_ALL else f"{friction:.0%} of"
        rubbing = [each for each in found.effects if _rubs(each)]
        which, most = _friction(rubbing, found), _most_friction(rubbing, found)
        said.append(f"{which} accounts for {what} the error reduction{most}.")
    said += [
        f"On {_place(each, found)}: {title_of(each.effect.kind)} ({_first(each)}), given the "
        "known mass."
        for each in found.named
        if _weighed(each)
    ]
    doubtful = (HeldOutVerdict.NOT_CONFIRMED, HeldOutVerdict.HARMFUL, HeldOutVerdict.WEIGHED)
    others = [each for each in found.named if not _rubs(each) and each.verdict not in doubtful]
    fall = found.fall if found.fall > 0.0 else inf
    worth = [each for each in others if each.error_reduction >= _WORTH_SAYING * fall]
    for each in sorted(worth, key=lambda each: -each.error_reduction)[:_MOST]:
        part = each.error_reduction / fall
        share = f", {part:.0%} of the error reduction" if part <= 1.0 else ""
        what = f"{title_of(each.effect.kind)} ({_first(each)}{share})"
        said.append(f"On {_place(each, found)}: {what}.")
    if not said:
        said.append(f"Your model lacks {counted(len(found.effects), 'small effect')}.")
    elif of_all.get(INERTIAS, 0.0) >= _WORTH_SAYING:
        said.append(f"Inertias that differ from the URDF account for {of_all[INERTIAS]:.0%}.")
    return " ".join(said)


def _weighed(named: NamedEffect) -> bool:
    """Whether it is based on the known mass, and no error need fall by it."""
    return named.verdict is HeldOutVerdict.WEIGHED


def _in_vain(found: Diagnosis) -> bool:
    """Whether effects that should be in the held-out data, too, lower nothing where joints move."""
    told = any(each.effect.runs or _weighed(each) for each in found.effects)
    return found.fall < 0.0 and not told


def _percent(found: Diagnosis) -> str:
    return relative_in_words(found.after.mean_relative_moving)


def _friction(rubbing: Sequence[NamedEffect], found: Diagnosis) -> str:
    """`Friction`, with what of it is no straight line and sure; or the one effect that it is."""
    if len(rubbing) > 1:
        sure = [each for each in rubbing if each.verdict is HeldOutVerdict.CONFIRMED]
        more = [title_of(kind) for kind in beside_straight(each.effect.kind for each in sure)]
        if not more:
            return "Friction"
        listed = " and ".join([", ".join(more[:-1]), more[-1]] if len(more) > 1 else more)
        return f"Friction, with {listed},"
    title = title_of(rubbing[0].effect.kind)
    return f"{title[:1].upper()}{title[1:]} of {_place(rubbing[0], found)} ({_first(rubbing[0])})"


def beside_straight(kinds: Iterable[str]) -> list[str]:
    """Kinds of friction that are no straight line over speed, each once."""
    straight = {each.kind for each in straight_friction(0)}
    return [kind for kind in dict.fromkeys(kinds) if kind not in straight]


def _most_friction(rubbing: Sequence[NamedEffect], found: Diagnosis) -> str:
    """`, largest on joint_1 (48 N·m at 1 rad/s)`, by the line of the joint with most of it.

    At a speed that it had: beyond the data the line may be negative.
    """
    joints = {joint for each in rubbing for joint in each.effect.joints}
    lines = [line for line in found.friction_lines if line.joint in joints]
    if not lines or len(rubbing) < 2:
        return ""
    most = max(lines, key=lambda line: abs(_at(_speed(line), line)))
    speed = _speed(most)
    unit = "m/s" if "/m" in most.viscous.unit else "rad/s"
    size = short_number(_at(speed, most), 2)
    return f", largest on {most.joint} ({size} {most.coulomb.unit} at {speed:g} {unit})"


def _at(speed: float, line: FrictionLine) -> float:
    return speed * line.viscous.value + line.coulomb.value


def _speed(line: FrictionLine) -> float:
    """1 rad/s (m/s), or 0.1, 0.01, … where the joint was not half as fast."""
    fastest = 1.0 if isnan(line.fastest) else max(2.0 * line.fastest, _STANDS)
    return min(1.0, 10.0 ** floor(log10(fastest)))


def _place(named: NamedEffect, found: Diagnosis) -> str:
    return place_in_words(named.effect, len(found.joint_names))


def _first(named: NamedEffect) -> str:
    """Its first number, which is its size; of several alike (roll, pitch) the largest."""
    linear = [p.name for p in catalogue()[named.effect.kind].parameters]
    (start, first), *others = named.parameters.items()
    alike = [x for name, x in others if {start, name} <= set(linear) and x.unit == first.unit]
    return _prefixed(max([first, *alike], key=lambda each: abs(each.value)))


def _prefixed(value: Value) -> str:
    """Two digits, with k and M where that is shorter."""
    for scale, prefix in _PREFIXES:
        if abs(value.value) >= scale and value.unit.startswith("N"):
            return f"{short_number(value.value / scale, 2)} {prefix}{value.unit}"
    unit = "" if value.unit == "1" else f" {value.unit}"
    return f"{short_number(value.value, 2)}{unit}"


def _left(found: Diagnosis) -> list[str]:
    """What stays: on average, where most, and what it depends on."""
    if not found.effects:
        return []
    after = found.after.relative_moving
    known = {joint: each for joint, each in after.items() if not isnan(each)}
    if not known:
        return []
    worst = max(known, key=lambda joint: known[joint])
    text = f"Held-out error {_percent(found)} of torque RMS (mean over joints, where they move)"
    if known[worst] > 1.5 * found.after.mean_relative_moving:
        text += f", largest on {worst} ({relative_in_words(known[worst])})"
    said = [text + "."]
    if any(each.kind == HELD_OUT_DIFFERS for each in found.findings):
        said.append("The held-out recording differs from the training ones (warning: how).")
    said += _worse_than_the_textbook(found)
    for each in found.unexplained[:1]:
        words = [covariate_in_words(covariate) for covariate in each.depends_on]
        listed = " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
        said.append(f"The residual of {each.joint} depends on {listed}.")
    return said


def _worse_than_the_textbook(found: Diagnosis) -> list[str]:
    """The joint that loses most by what was found: a mean hides it."""
    if found.textbook is None:
        return []
    before, after = found.textbook.error.relative_moving, found.after.relative_moving
    lost = {joint: after[joint] - before[joint] for joint in after if joint in before}
    worse = {
        joint: loss
        for joint, loss in lost.items()
        if loss > _LOST and after[joint] > _LOST_TIMES * before[joint]
    }
    if not worse:
        return []
    joint = max(worse, key=worse.__getitem__)
    return [
        f"On {joint} this model is worse than textbook friction "
        f"({relative_in_words(after[joint])}, with that {relative_in_words(before[joint])})."
    ]


def _next(found: Diagnosis) -> str:
    """What to do first: resolve doubts of the set-up, or distinguish what fits as well."""
    if not found.effects:
        return ""
    if any(each.kind == OPEN_SETUP for each in found.findings):
        return "Next: resolve the doubt about the set-up (excite inspect), and diagnose again."
    if _in_vain(found):
        warned = sum(each.severity == "warning" for each in found.findings)
        first_of_all = f"resolve {counted(warned, 'warning')} about the data"
        return f"Next: {first_of_all if warned else 'record another motion, or a longer one'}."
    open_names = [each for each in found.effects if each.aliases]
    if not open_names:
        return ""
    by_motion = [each for each in open_names if not _weighed(each)]
    first = max(
        by_motion or open_names,
        key=lambda each: 0.0 if isnan(each.error_reduction) else each.error_reduction,
    )
    other = first.aliases[0]
    names = f"{title_of(first.effect.kind)} of {_place(first, found)} from {title_of(other.kind)}"
    if other.joints != first.effect.joints:
        names += f" of {place_in_words(other, len(found.joint_names))}"
    if not by_motion:
        return (
            f"Next: a run with a known load ({KNOWN_LOAD}) distinguishes {names}; no motion does."
        )
    return f"Next: a motion that distinguishes {names}."
