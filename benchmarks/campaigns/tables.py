"""Outcomes as text: a line per case, the table of groups, the rates of acceptance, failures."""

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.battery.tables import Rate
from benchmarks.campaigns.cases import CLEAN, GROUPS, WITH_COLUMNS
from benchmarks.campaigns.judge import Judged, Outcome
from benchmarks.campaigns.scoring import Size

HEADER = (
    f"{'case':>4} {'group':16} {'robot':8} {'runs':>4} {'friction':10} {'noise':>5} {'ar':>4} "
    f"{'verdict':22} {'before':>6} {'after':>6} {'s':>5}  planted -> named"
)


def line(o: Outcome) -> str:
    """One case."""
    return (
        f"{o.index:4} {o.group:16} {o.robot:8} {o.runs:4} {o.friction:10} {100 * o.noise:4.1f}% "
        f"{o.correlation:4.2f} {verdict(o):22} {100 * o.before:5.1f}% {100 * o.after:5.1f}% "
        f"{sum(o.seconds.values()):5.1f}  {'; '.join(o.planted) or 'nothing'} -> {_named(o)}"
    )


def verdict(o: Outcome) -> str:
    """A few words."""
    if o.refused:
        return "REFUSED"
    if o.error:
        return "ERROR"
    words = []
    if o.group in CLEAN:
        words.append("ALARM" if o.alarm else "ok")
    elif o.planted:
        words.append("ok" if o.right else "missed")
    if o.wrong:
        words.append("WRONG")
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
    if o.unexplained:
        words.append("unexplained@" + "+".join(each["joint"] for each in o.unexplained))
    if o.left:
        words.append("left@" + "+".join(o.left))
    if o.silent:
        words.append("silent on " + ", ".join(f"{j} ({o.rest[j]:.1f})" for j in o.silent))
    return "; ".join(words) or "nothing"


def where(joints: Sequence[str]) -> str:
    """`j1+j2`, or `all` of many."""
    return "+".join(joints) if len(joints) < 4 else "all"


def unsaid(o: Outcome) -> bool:
    """Whether the held-out error rose, as a whole or on a joint, and nothing says so."""
    return (o.worse and not o.admitted) or bool(o.worse_joints)


def rates(outcomes: Sequence[Outcome]) -> list[Rate]:
    """The criteria of acceptance. What failed with an error counts against every one."""
    planted = [o for o in outcomes if o.planted]
    clean = [o for o in outcomes if o.group in CLEAN]
    sizes = [size for o in outcomes for size in o.sizes]
    first = [size for size in sizes if size["first_order"]]
    broken = [o for o in outcomes if o.error]

    def of(part: Sequence[Outcome], flags: Iterable[bool]) -> int:
        return sum(map(bool, flags)) + sum(o in broken for o in part)

    return [
        Rate("right name or alias set", sum(o.right and not o.error for o in planted),
             len(planted), 0.92, True),
        Rate("wrong names", of(outcomes, (o.wrong for o in outcomes)), len(outcomes), 0.02, False),
        Rate("large rest without a word", of(outcomes, (bool(o.silent) for o in outcomes)),
             len(outcomes), 0.0, False),
        Rate("false alarms on clean", of(clean, (o.alarm for o in clean)), len(clean), 0.05, False),
        Rate("false refusals", len(broken), len(outcomes), 0.0, False),
        Rate("harmful, or error not lowered, and unsaid",
             of(outcomes, (unsaid(o) for o in outcomes)), len(outcomes), 0.0, False),
        Rate("sizes within 2 sd", sum(s["within"] for s in sizes), len(sizes), 0.93, True),
        Rate("of first-order effects", sum(s["within"] for s in first), len(first), 0.93, True),
    ]  # fmt: skip


def groups(outcomes: Sequence[Outcome]) -> list[str]:
    """A row per group, and the total."""
    head = (
        f"{'group':18} {'cases':>5} {'right':>7} {'wrong':>5} {'silent':>6} {'alarm':>5} "
        f"{'refused':>7} {'worse unsaid':>12} {'sizes in 2 sd':>13} {'s':>6}"
    )
    every = (*GROUPS, *WITH_COLUMNS)
    rows = [_row(group, [o for o in outcomes if o.group == group]) for group in every]
    return [head, *filter(None, rows), _row("all", outcomes)]


def _row(name: str, part: Sequence[Outcome]) -> str:
    if not part:
        return ""
    planted = [o for o in part if o.planted]
    clean = [o for o in part if not o.planted]
    sizes = [size for o in part for size in o.sizes]
    right = f"{sum(o.right and not o.error for o in planted)}/{len(planted)}"
    alarm = f"{sum(o.alarm for o in clean)}/{len(clean)}"
    within = f"{sum(s['within'] for s in sizes)}/{len(sizes)}"
    seconds = float(np.median([sum(o.seconds.values()) for o in part]))
    return (
        f"{name:18} {len(part):5} {right:>7} {sum(o.wrong for o in part):5} "
        f"{sum(bool(o.silent) for o in part):6} {alarm:>5} {sum(bool(o.error) for o in part):7} "
        f"{sum(unsaid(o) for o in part):12} {within:>13} {seconds:6.1f}"
    )


def failures(outcomes: Sequence[Outcome]) -> list[str]:
    """What went wrong, case by case, and sizes beyond 2 sd."""
    lines = []
    for o in sorted(outcomes, key=lambda o: o.index):
        good = verdict(o) == "ok"
        far = [s for s in o.sizes if not s["within"]]
        if not good:
            lines.append(line(o))
        lines += [
            f"     {o.index} size {s['kind']} {s['parameter']}: {s['value']:.4g} ± {s['std']:.2g} "
            f"(1 sd), planted {s['true']:.4g}, z {(s['value'] - s['true']) / s['std']:.1f}"
            for s in far
        ]
    return lines


def in_detail(judged: Judged) -> str:
    """All that is known of one case."""
    o, found = judged.outcome, judged.diagnosis
    text = [HEADER, line(o), f"held out {o.held_out}; seconds {o.seconds}"]
    if judged.case is not None:
        text += [
            f"planted: {plant.in_words} sizes {dict(plant.sizes)} "
            f"by run {dict(plant.by_run)} shape {dict(plant.effects[0].effect.shape)}"
            for plant in judged.case.plants
            if plant.required
        ]
        text.append(f"instruments: {judged.case.instruments}")
    if found is None:
        return "\n".join([*text, o.error])
    text += [f"named ({each['judged']}): {each}" for each in o.named]
    text += [f"unexplained: {each}" for each in o.unexplained]
    text += [f"finding: {f.severity} {f.kind} {f.run} {f.joints}: {f.text}" for f in found.findings]
    text += [f"size: {Size(**{k: s[k] for k in _SIZE})} within {s['within']}" for s in o.sizes]
    for r in found.rounds:
        text.append(f"round {r.index}: {r.verdict}")
        text += [
            f"    {s.effect.kind}@{where(s.effect.joints)} {s.effect.shape} {s.effect.runs} "
            f"p {s.p_value:.1e} share {s.share_of_residual:.3f} gain {s.gain:.3f}: {s.verdict}"
            for s in r.suspects
        ]
    text.append("rest over floor: " + ", ".join(f"{j} {x:.2f}" for j, x in o.rest.items()))
    return "\n".join([*text, o.error])


_SIZE = ("kind", "parameter", "true", "value", "std")
