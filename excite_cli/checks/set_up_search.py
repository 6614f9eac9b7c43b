"""The set-up that explains the data, found step by step from the one that is declared.

Everything that people set up wrongly is tried at once, and the alternative with which the same
textbook model explains most is taken, if it explains far more; then the next. It is a fault where
hardly anything of the torques concerned fits as they are, whatever the inertias, and nearly all of
it the other way; else a doubt, and the person decides.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.checks.catalogue import setup_checks
from excite_cli.checks.setup import Samples, Setup
from excite_cli.checks.setup_check import CLEAR, Alternative, SetupCheck
from excite_cli.checks.textbook_fit import FLOOR, TextbookFit, TextbookShares
from excite_cli.checks.trust import is_trusted
from excite_cli.config.spec import Spec
from excite_cli.measurement.dataset import Mask
from excite_cli.robot.model import Array, Robot

# Whether a set-up leaves joints within their limits: one that does not is hardly the true one.

_SLACK = 0.1  # of a joint's range, by which limits of descriptions may be passed
_STEP = np.radians(25.0)  # half of the widest step in which zeros are sought, and some
_TURNS = 2.0 * np.pi * np.arange(-1, 2)  # rad; an angle says nothing of whole turns


def beyond_limits(robot: Robot, samples: Samples, setup: Setup) -> Mask:
    """Joints (n,) that are beyond their limits by more than a tenth of their range, set up so.

    Those that turn by 25° at least, since zeros are sought in steps of 30 to 45°.
    """
    q = setup.motion(samples)[0]
    low, high = q.min(axis=0), q.max(axis=0)
    slack = _SLACK * (robot.limits.upper - robot.limits.lower)
    slack = np.maximum(slack, np.where(robot.sliding, 0.0, _STEP))
    lower, upper = robot.limits.lower - slack, robot.limits.upper + slack
    turned = _TURNS[:, None] * ~robot.sliding
    within = (low + turned >= lower) & (high + turned <= upper)
    return ~(within.any(axis=0) | ~np.isfinite(upper - lower))


# What an alternative must gain beside `CLEAR` in L: in the logarithm of the share of some joint,
# which falls to 0.7 of what it was (all a little better is what effects do), unless it is the
# bodies that are bent less. Of what shows on all joints a third must gain, too.
_FALLS, _GAINS, _SHOWN = 0.35, 0.2, 0.33
_AS_GOOD = 0.35  # of L: alternatives that differ by less are told together
_ROUGH, _CANDIDATES = 100, 4  # samples by which many alternatives are ranked; how many are kept
_FINE = 2e-3  # share below which no difference is made between values of one thing
_GOOD = 0.03  # data that leave less than this on every joint are what they say they are
_STEPS = 4
# A mistake is certain where so much of the torques concerned is left as they are (inertias would
# have to be 5 standard deviations off), and it gains so much in L: odds of 10 to 1 where it leaves
# hardly anything, else of 50 to 1.
_CERTAIN, _SURE, _HARDLY, _SURER = 0.15, 2.3, 0.1, 4.0

_Question = tuple[str, tuple[int, ...], str]  # check, joints, variant


@dataclass(frozen=True)
class SetUpMistake:
    """One mistake: whose it is, the set-up without and with it undone, how well the data fit.

    `rivals`: alternatives that explain about as much.
    """

    check: SetupCheck
    before: Setup
    after: Alternative
    left_before: TextbookShares
    left_after: TextbookShares
    rivals: "tuple[_Candidate, ...]" = ()

    @property
    def question(self) -> _Question:
        """What is set up: of one question there is one answer."""
        return self.check.name, self.after.joints, self.after.variant

    @property
    def concerned(self) -> Mask:
        """Joints (n,) whose torques it explains better, or whose own columns it changes."""
        better = _gain(self.left_after, self.left_before) > _GAINS
        own = np.zeros(len(better), bool)
        own[list(self.after.joints) or slice(None)] = True
        return better if better.any() else own

    @property
    def is_certain(self) -> bool:
        """Whether no inertias could make the torques concerned what they are recorded as."""
        one, other = self.left_after, self.left_before
        before, after = (np.median(each.shares[self.concerned]) for each in (other, one))
        gain = other.loss - one.loss
        bent = other.bent - one.bent > _SURE
        if self.check.is_physical:
            return False
        return bool((before > _CERTAIN or bent) and gain > (_SURE if after < _HARDLY else _SURER))


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An alternative of a check, and how well the data fit with it."""

    check: SetupCheck
    alternative: Alternative
    explained: TextbookShares

    @property
    def cost(self) -> float:
        """L, and what is asked of the less likely."""
        return self.explained.loss + self.alternative.price

    @property
    def question(self) -> _Question:
        """What is set up: of one question there is one answer."""
        return self.check.name, self.alternative.joints, self.alternative.variant

    def is_far_better(self, other: TextbookShares) -> bool:
        """Whether it explains far more than another set-up."""
        gain = _gain(self.explained, other)
        shown = not self.check.of_all or np.mean(gain[other.judged] > _GAINS) >= _SHOWN
        falls = gain.max() > _FALLS or other.bent - self.explained.bent > CLEAR
        return bool(self.cost < other.loss - CLEAR and falls and shown)


def mistakes(fit: TextbookFit, spec: Spec) -> list[SetUpMistake]:
    """Mistakes, the one that explains most first, until none explains far more.

    What the config says of a joint itself is taken as it is. The first may have explained in part
    what is another mistake: unless it alone leaves next to nothing, what is found without it is
    taken, if that explains more, or as much with less.
    """
    rough = TextbookFit(fit.robot, fit.samples.thinned(_ROUGH), _FINE)
    setup = Setup.as_declared(fit.robot)
    first = list(_candidates(fit, rough, spec, setup, fit(setup)))
    found = list(_steps(fit, rough, spec, first))
    if not found or (len(found) == 1 and found[0].left_after.shares.max() < _HARDLY):
        return found
    others = list(_steps(fit, rough, spec, first, found[0].question))
    return min(found, others, key=lambda steps: _total(fit, steps))


def _total(fit: TextbookFit, steps: Sequence[SetUpMistake]) -> float:
    """L of what several steps leave, and what each of them must gain."""
    left = steps[-1].left_after if steps else fit(Setup.as_declared(fit.robot))
    return left.loss + sum(CLEAR + step.after.price for step in steps)


def _steps(
    fit: TextbookFit,
    rough: TextbookFit,
    spec: Spec,
    first: Sequence[_Candidate],
    never: _Question | None = None,
) -> Iterator[SetUpMistake]:
    """Steps, each the best of its turn, without the answers to one question."""
    setup = Setup.as_declared(fit.robot)
    explained = fit(setup)
    for turn in range(_STEPS):
        if not explained.judged.any() or explained.shares[explained.judged].max() < _GOOD:
            return
        tried = _candidates(fit, rough, spec, setup, explained) if turn else first
        found = [e for e in tried if e.question != never and e.is_far_better(explained)]
        if not found:
            return
        best = min(found, key=lambda each: each.cost)
        near = [each for each in found if each.explained.loss < best.explained.loss + _AS_GOOD]
        same = [each for each in near if each.question == best.question]
        best = next((each for each in same if each.alternative.is_plain), best)
        rivals = [each for each in near if each not in same]
        step = SetUpMistake(
            best.check, setup, best.alternative, explained, best.explained, tuple(rivals)
        )
        yield step
        setup, explained = best.alternative.setup, best.explained


def _gain(one: TextbookShares, other: TextbookShares) -> Array:
    return np.log(np.maximum(other.shares, FLOOR) / np.maximum(one.shares, FLOOR))


def _candidates(
    fit: TextbookFit, rough: TextbookFit, spec: Spec, setup: Setup, explained: TextbookShares
) -> Iterator[_Candidate]:
    names, beyond = fit.robot.joint_names, beyond_limits(fit.robot, rough.samples, setup)
    for check in setup_checks():
        if is_trusted(check.name, spec):
            continue
        settled = {j for j, name in enumerate(names) if check.is_declared(name, spec)}
        every = check.alternatives(fit, setup, explained)
        some = [
            each
            for each in every
            if settled.isdisjoint(each.joints)
            and not (beyond_limits(fit.robot, rough.samples, each.setup) & ~beyond).any()
        ]
        if len(some) > _CANDIDATES:
            some = _best_of_each(some, [rough(each.setup).loss for each in some])[:_CANDIDATES]
        for each in some:
            for better in check.refined(rough, each):
                yield _Candidate(check, better, fit(better.setup))


def _best_of_each(some: Sequence[Alternative], losses: Sequence[float]) -> list[Alternative]:
    """The best alternative of every set of joints and variant, best first."""
    found: dict[tuple[tuple[int, ...], str], Alternative] = {}
    for i in np.argsort(losses):
        found.setdefault((some[i].joints, some[i].variant), some[i])
    return list(found.values())
