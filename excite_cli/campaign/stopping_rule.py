"""What still matters after a round, and whether the campaign ends."""

from dataclasses import replace
from math import isfinite

from excite_cli.campaign.records import Campaign, pace_of
from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.diagnosis.words import place_in_words, title_of

# How much more of a joint's torque, or in N·m, may be left on the newest motion than on those that
# the model was fitted to.
_AS_GOOD = 1.5
_SMALL = 0.002  # of the torque: less is not looked at
_IN_VAIN = 3  # rounds that tried to tell a pair of effects apart


def left_on_newest(found: Diagnosis) -> list[str]:
    """Joints whose torque the model misses more on the newest motion than where it was fitted."""
    trained, held_out = found.trained, found.after
    if trained is None:
        return []
    said = []
    for joint in found.joint_names:
        left, usual = held_out.relative_moving.get(joint), trained.relative_moving.get(joint)
        if left is None or usual is None or not (isfinite(left) and isfinite(usual)):
            continue
        share = left / max(usual, _SMALL)
        size = held_out.rms_moving.get(joint, 0.0) / max(trained.rms_moving.get(joint, 0.0), 1e-300)
        if min(share, size) > _AS_GOOD:
            said.append(
                f"{joint}: residual {left:.2%} of its torque on {found.held_out_run}, "
                f"{share:.1f} times that of the earlier motions"
            )
    return said


def still_open(found: Diagnosis, pairs: tuple[str, ...]) -> tuple[str, ...]:
    """What still matters, in sentences; `pairs`: effects that a motion could tell apart."""
    said = [f"{pair}: not distinguished yet" for pair in pairs]
    said += [f"{joint}: excess residual of the torque" for joint in found.joints_with_residual]
    said += left_on_newest(found)
    said += [
        f"{title_of(each.effect.kind)} on {place_in_words(each.effect, len(found.joint_names))}: "
        "the newest motion is predicted worse with it"
        for each in found.effects
        if each.verdict is HeldOutVerdict.HARMFUL
        and min((r.relative_moving for r in each.removes.values()), default=0.0) < -_SMALL
    ]
    if not found.good:
        said.append("the effects found do not lower the error on the newest motion")
    return tuple(said)


def ended(campaign: Campaign, until: float | None) -> Campaign:
    """The campaign with how it ended, if it did.

    `until`: the share of one sample's noise to which torques are to be known (sequence.until).
    """
    last = campaign.rounds[-1] if campaign.rounds else None
    if last is None or last.learned is None:
        return campaign
    learned, asked = last.learned, campaign.asked
    lacking = list(learned.open)
    if max(last.pace, pace_of(last.number, asked.from_speed)) < 1.0:
        lacking.append("no motion has been played at full speed yet")
    if last.number < 2:
        lacking.append("no exploration motion has been tested yet")
    elif until is not None and not (learned.torque_deviation or 0.0) <= until:
        lacking.append(
            f"the predicted torque deviates by {learned.torque_deviation:.2g} times the standard "
            f"deviation of the torque noise, and sequence.until asks for {until:.2g}"
        )
    if not lacking:
        text = (
            f"Converged: the model, identified without {last.motions[-1].name}, predicts that "
            f"motion at training level (held-out error {learned.after:.2%} of the torque)"
        )
        told = f" Effects: {', '.join(learned.effects)}; none is ambiguous."
        reason = f"{text}.{told * bool(learned.effects)}"
        return replace(campaign, ended="complete", reason=reason)
    why = ""
    if last.number >= asked.most_rounds:
        why = f"the budget of {asked.most_rounds} rounds (--max-rounds) is spent"
    elif 0.0 < asked.most_seconds <= campaign.seconds:
        why = f"the robot moved for {campaign.seconds:.0f} s (--max-seconds)"
    if why:
        text = f"Not finished, {why}. Open: {'; '.join(lacking)}."
        return replace(campaign, ended="budget", reason=text)
    return _in_vain(campaign)


def _in_vain(campaign: Campaign) -> Campaign:
    """Ended where several motions could not tell apart what alone is open."""
    last = campaign.rounds[-_IN_VAIN:]
    learned = [each.learned for each in last if each.learned is not None]
    if len(learned) < _IN_VAIN:
        return campaign
    pairs = set(learned[0].pairs).intersection(*(each.pairs for each in learned[1:]))
    if not pairs or any(len(each.open) > len(each.pairs) for each in learned):
        return campaign
    text = (
        f"Not finished: {_IN_VAIN} rounds did not distinguish {'; '.join(sorted(pairs))}. Nothing "
        "else is open."
    )
    return replace(campaign, ended="stuck", reason=text)
