"""Outcomes as text: a line per case, the table of groups, the rates of acceptance, failures."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.battery.decks import DECKS
from benchmarks.battery.judge import Judged, Outcome
from benchmarks.battery.scoring import where

HEADER = (
    f"{'case':>4} {'group':16} {'robot':10} {'friction':10} {'noise':>5} {'ar':>4} "
    f"{'verdict':16} {'before':>6} {'after':>6} {'ratio':>5} {'s':>5}  planted -> named"
)
RATIO = 1.1  # of the error to that of the fit that knows the truth
AS_GOOD, SLOWEST = 1.02, 60.0  # beside the best textbook's; seconds of a diagnosis


def line(o: Outcome) -> str:
    """One case."""
    planted = "; ".join(_planted(each) for each in o.planted) or o.words or "nothing"
    return (
        f"{o.index:4} {o.group:16} {o.robot:10} {o.friction:10} {100 * o.noise:4.1f}% "
        f"{o.correlation:4.2f} {verdict(o):16} {100 * o.before:5.1f}% {100 * o.after:5.1f}% "
        f"{o.ratio:5.2f} {sum(o.seconds.values()):5.1f}  {planted} -> {_named(o)}"
    )


def _planted(each: dict) -> str:
    """With its share of the torque, where that is known."""
    return each["words"] + (f" ({each['ratio']:.1%})" if each["ratio"] == each["ratio"] else "")


def is_clean(o: Outcome) -> bool:
    """Whether the robot lacks nothing, by its group."""
    return o.group.startswith("clean")


def verdict(o: Outcome) -> str:
    """A few words."""
    if o.error:
        return "REFUSED" if o.refused else "ERROR"
    words = []
    if is_clean(o):
        words.append("ALARM" if o.alarm else "ok")
    elif o.planted:
        good = o.seen if o.group == "outside" else o.right
        words.append("ok" if good else "seen" if o.detected else "missed")
    words += [word for word, is_so in (("WRONG", o.wrong), ("extra", o.extra)) if is_so]
    if o.silent:
        words.append("SILENT")
    if o.worse or o.worse_joints:
        words.append("WORSE" if unsaid(o) else "worse")
    return "+".join(words) or "ok"


def _named(o: Outcome) -> str:
    if o.error:
        return o.error.strip().splitlines()[-1]
    words = []
    for each in o.named:
        runs = f" in {'+'.join(each['runs'])}" if each["runs"] else ""
        runs += f" by {each['covariate']}" if each["covariate"] else ""
        mark = "" if each["judged"] == "true" else f" ({each['judged']})"
        words.append(f"{each['kind']}@{where(each['joints'])}{runs}{mark}")
    if o.left:
        words.append("unexplained@" + "+".join(o.left))
    if o.silent:
        words.append("silent on " + ", ".join(f"{j} ({o.rest[j]:.1f})" for j in o.silent))
    return "; ".join(words) or "nothing"


def unsaid(o: Outcome) -> bool:
    """Whether the held-out error rose, as a whole or on a joint, and nothing says so."""
    return (o.worse and not o.admitted) or bool(o.worse_joints)


@dataclass(frozen=True)
class Rate:
    """`count` of `out_of`, to be at least or at most `bound`."""

    name: str
    count: int
    out_of: int
    bound: float
    least: bool

    @property
    def value(self) -> float:
        return self.count / self.out_of if self.out_of else float("nan")

    @property
    def kept(self) -> bool:
        met = self.value >= self.bound if self.least else self.value <= self.bound
        return met or not self.out_of

    def text(self) -> str:
        sign = "≥" if self.least else "≤"
        state = "kept" if self.kept else "BROKEN"
        return (
            f"{self.name:44} {self.count:4} of {self.out_of:<4} {100 * self.value:6.1f} %  "
            f"({sign} {100 * self.bound:.0f} %: {state})"
        )


def rates(outcomes: Sequence[Outcome], deck: str) -> list[Rate]:
    """The criteria of acceptance. What failed with an error counts against every one."""
    return _RATES[DECKS[deck].beside](outcomes)


def _with_oracle(outcomes: Sequence[Outcome]) -> list[Rate]:
    clean = [o for o in outcomes if is_clean(o)]
    planted = [o for o in outcomes if not is_clean(o)]
    nameable = [o for o in planted if o.group != "outside"]
    named = [o for o in nameable if right(o) and o.group not in ("absorbed", "history")]
    good = [o for o in named if o.ratio <= RATIO and o.joint_ratio <= RATIO]
    return [
        Rate("detected", _count(o.detected for o in planted), len(planted), 0.95, True),
        Rate("right name, alias set or absorbed", _count(map(right, nameable)), len(nameable),
             0.90, True),
        Rate("cases with a wrong name", _count(o.wrong or o.error for o in planted), len(planted),
             0.03, False),
        _alarms(clean),
        Rate("error within 1.1 of the oracle, where named", len(good), len(named), 0.90, True),
    ]  # fmt: skip


def _of_campaigns(outcomes: Sequence[Outcome]) -> list[Rate]:
    every, planted = len(outcomes), [o for o in outcomes if o.planted]
    sizes = [size for o in outcomes for size in o.sizes]
    first = [size for size in sizes if size["first_order"]]
    return [
        Rate("right name or alias set", _count(map(right, planted)), len(planted), 0.92, True),
        Rate("wrong names", _count(o.wrong or o.error for o in outcomes), every, 0.02, False),
        Rate("large rest without a word", _count(o.silent or o.error for o in outcomes), every,
             0.0, False),
        _alarms([o for o in outcomes if is_clean(o)]),
        Rate("false refusals", _count(o.error for o in outcomes), every, 0.0, False),
        Rate("harmful, or error not lowered, and unsaid",
             _count(unsaid(o) or o.error for o in outcomes), every, 0.0, False),
        Rate("sizes within 2 sd", _count(s["within"] for s in sizes), len(sizes), 0.93, True),
        Rate("of first-order effects", _count(s["within"] for s in first), len(first), 0.93, True),
    ]  # fmt: skip


def _beside_textbook(outcomes: Sequence[Outcome]) -> list[Rate]:
    told, count = [o for o in outcomes if not o.error], len(outcomes)
    good = _count(o.ratio <= AS_GOOD for o in told)
    slow = [o for o in told if o.seconds["diagnose"] > SLOWEST]
    return [
        Rate("answers", len(told), count, 1.0, True),
        Rate("no worse than the textbook", good, count, 0.99, True),
        Rate("wrong names confirmed", _count(o.wrong for o in told), count, 0.02, False),
        Rate("within a minute", len(told) - len(slow), count, 1.0, True),
    ]


def _alarms(clean: Sequence[Outcome]) -> Rate:
    alarms = _count(o.alarm or o.error for o in clean)
    return Rate("false alarms on clean", alarms, len(clean), 0.05, False)


_RATES = {"truth": _with_oracle, "before": _of_campaigns, "textbook": _beside_textbook}


def right(o: Outcome) -> bool:
    """Whether all that was planted is told."""
    return o.right and not o.error


def _count(flags: Iterable[object]) -> int:
    return sum(map(bool, flags))


def groups(outcomes: Sequence[Outcome]) -> list[str]:
    """A row per group, and the total."""
    head = (
        f"{'group':28} {'cases':>5} {'detected':>8} {'right':>7} {'wrong':>5} {'silent':>6} "
        f"{'alarm':>5} {'error':>5} {'worse unsaid':>12} {'sizes in 2 sd':>13} {'ratio':>6} "
        f"{'s':>6}"
    )
    names = sorted({o.group for o in outcomes})
    rows = [_row(name, [o for o in outcomes if o.group == name]) for name in names]
    return [head, *rows, _row("all", outcomes)]


def _row(name: str, part: Sequence[Outcome]) -> str:
    planted = [o for o in part if o.planted]
    clean = [o for o in part if is_clean(o)]
    sizes = [size for o in part for size in o.sizes]
    told = f"{_count(map(right, planted))}/{len(planted)}"
    within = f"{_count(s['within'] for s in sizes)}/{len(sizes)}"
    ratios = [o.ratio for o in part if np.isfinite(o.ratio)] or [np.nan]
    seconds = float(np.median([sum(o.seconds.values()) for o in part])) if part else 0.0
    return (
        f"{name:28} {len(part):5} {_count(o.detected for o in part):8} {told:>7} "
        f"{_count(o.wrong for o in part):5} {_count(o.silent for o in part):6} "
        f"{f'{_count(o.alarm for o in clean)}/{len(clean)}':>5} "
        f"{_count(o.error for o in part):5} {_count(map(unsaid, part)):12} {within:>13} "
        f"{np.median(ratios):6.2f} {seconds:6.1f}"
    )


def failures(outcomes: Sequence[Outcome]) -> list[str]:
    """What went wrong, case by case, and sizes beyond 2 sd."""
    lines = []
    for o in sorted(outcomes, key=lambda o: o.index):
        if verdict(o) != "ok":
            lines.append(line(o))
        lines += [
            f"     {o.index} size {s['kind']} {s['parameter']}: {s['value']:.4g} ± {s['std']:.2g} "
            f"(1 sd), planted {s['true']:.4g}, z {(s['value'] - s['true']) / s['std']:.1f}"
            for s in o.sizes
            if not s["within"]
        ]
    return lines


def in_detail(judged: Judged) -> str:
    """All that is known of one case."""
    o, found = judged.outcome, judged.diagnosis
    text = [HEADER, line(o), f"held out {o.held_out}; seconds {o.seconds}"]
    text += [f"planted: {each}" for each in o.planted]
    if found is None:
        return "\n".join([*text, o.error])
    if judged.case is not None and judged.case.instruments is not None:
        text.append(f"instruments: {judged.case.instruments}")
    parts = {"named": o.named, "unexplained": o.unexplained, "absorbed": found.absorbed,
             "finding": found.findings, "size": o.sizes, "round": found.rounds}  # fmt: skip
    text += [f"{name}: {each}" for name, listed in parts.items() for each in listed]
    text += [f"processing: {name} = {value}" for name, value in found.processing.items()]
    before, after = found.before.relative_moving, found.after.relative_moving
    text += [
        f"{joint:26} {before[joint]:8.4f} {after[joint]:8.4f} rest {o.rest.get(joint, np.nan):.2f}"
        for joint in found.joint_names
    ]
    text.append(f"mean before {o.before:.4f}, after {o.after:.4f}, compared with {o.best:.4f}")
    return "\n".join([*text, o.error])
