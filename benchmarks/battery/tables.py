"""Outcomes as text: a line per case, the confusion table, the rates of acceptance."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.battery.judge import Judged, Outcome

HEADER = (
    f"{'case':>4} {'robot':10} {'fr':2} {'noise':>6} {'corr':>4}  {'planted':58} {'size':>6} "
    f"{'seen':>6} {'verdict':10} {'ratio':>6} {'joint':>6} {'s':>5}  named"
)
RATIO = 1.1


def line(o: Outcome) -> str:
    """One case."""
    planted = " + ".join(f"{p['kind']}@{_where(p['joints'])}" for p in o.planted) or o.group
    size = "+".join(f"{100 * p['ratio']:.1f}" for p in o.planted)
    seen = "+".join(f"{100 * p['visible']:.2g}" for p in o.planted)
    return (
        f"{o.index:4} {o.robot:10} {'f' if o.friction else '-':2} {100 * o.noise:5.2f}% "
        f"{o.correlation:4.2f}  {planted:58} {size:>6} {seen:>6} {verdict(o):10} {o.ratio:6.2f} "
        f"{o.joint_ratio:6.2f} {sum(o.seconds.values()):5.0f}  {_named(o)}"
    )


def verdict(o: Outcome) -> str:
    """One or two words."""
    if o.error:
        return "ERROR"
    if o.group == "clean":
        return "ALARM" if o.found else "ok"
    if o.group == "outside":
        good = "ok" if o.score["unexplained_there"] else ("seen" if o.detected else "missed")
        return "WRONG" if o.wrong else good
    words = "ok" if o.right else ("seen" if o.detected else "missed")
    if o.wrong:
        words += "+WRONG"
    return words + ("+extra" if o.extra else "")


def _named(o: Outcome) -> str:
    if o.error:
        return o.error.strip().splitlines()[-1]
    words = [
        f"{f['verdict']}: {f['kind']}@{_where(f['joints'])}"
        + (f" [{', '.join(a['kind'] for a in f['aliases'])}]" if f["aliases"] else "")
        for f in o.found
    ]
    words += ["absorbed"] * o.absorbed
    if o.unexplained:
        words.append("unexplained@" + ",".join(u["joint"] for u in o.unexplained))
    return "; ".join(words) or "nothing"


def _where(joints: Sequence[str]) -> str:
    return "+".join(joints) if len(joints) < 4 else "all"


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


def rates(outcomes: Sequence[Outcome]) -> list[Rate]:
    """The criteria of acceptance. What failed with an error counts against every one."""
    planted = [o for o in outcomes if o.group != "clean"]
    nameable = [o for o in planted if o.group != "outside"]
    clean = [o for o in outcomes if o.group == "clean"]
    named = [o for o in nameable if o.right and o.group not in ("absorbed", "history")]
    good = [o for o in named if o.ratio <= RATIO and o.joint_ratio <= RATIO]
    return [
        Rate("detected", sum(o.detected for o in planted), len(planted), 0.95, True),
        Rate("right name, alias set or absorbed", sum(o.right for o in nameable), len(nameable),
             0.90, True),
        Rate("cases with a wrong name", sum(o.wrong or bool(o.error) for o in planted),
             len(planted), 0.03, False),
        Rate("false alarms on clean data", sum(bool(o.found or o.error) for o in clean), len(clean),
             0.05, False),
        Rate("error within 1.1 of the oracle, where named", len(good), len(named), 0.90, True),
    ]  # fmt: skip


def details(outcomes: Sequence[Outcome]) -> list[str]:
    """Figures beside the criteria."""
    found = []
    for group in ("one", "two", "absorbed", "outside", "history", "hard", "clean"):
        part = [o for o in outcomes if o.group == group]
        if part:
            found.append(
                f"{group:9} {len(part):4} cases: detected {_count(o.detected for o in part)}, "
                f"right {_count(o.right for o in part)}, "
                f"wrong name {_count(o.wrong for o in part)} "
                f"(truth beside it {_count(o.wrong and o.right for o in part)}), "
                f"extra {_count(o.extra for o in part)}, "
                f"unexplained there {_count(o.score.get('unexplained_there', False) for o in part)}"
                f", anything unexplained {_count(bool(o.unexplained) for o in part)}, "
                f"errors {_count(bool(o.error) for o in part)}"
            )
    for robot in sorted({o.robot for o in outcomes if o.robot}):
        part = [o for o in outcomes if o.robot == robot and o.group in ("one", "two", "absorbed")]
        found.append(
            f"{robot:11} {len(part)} cases: right {_count(o.right for o in part)}, "
            f"wrong name {_count(o.wrong for o in part)}"
        )
    return [*found, *_sizes(outcomes), _seconds(outcomes)]


def _sizes(outcomes: Sequence[Outcome]) -> list[str]:
    """Of friction with memory: size and distance beside what was planted.

    Of a form that is not Dahl's, part of the friction is Coulomb's to these data.
    """
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for o in outcomes:
        for p in o.planted if o.group == "history" else ():
            for f in o.found:
                if (f["kind"], f["joints"]) == (p["kind"], p["joints"]):
                    (value, std), true = f["sizes"]["friction"], p["values"][0]
                    distance = f["shape"]["distance"] / p["shape"]["distance"]
                    found = ((value - true) / std, value / true, distance)
                    rows.setdefault(o.kind, []).append(found)
    return [
        f"{kind:14} {len(found)} sizes, {_count(abs(each[0]) < 2.0 for each in found)} within 2 sd"
        + "".join(
            f"; {name} found/planted {min(column):.2f} to {max(column):.2f}"
            for name, column in zip(
                ("size", "distance"), [*zip(*found, strict=True)][1:], strict=True
            )
        )
        for kind, found in rows.items()
    ]


def _seconds(outcomes: Sequence[Outcome]) -> str:
    words = []
    for name in ("simulate", "diagnose", "oracle"):
        times = [o.seconds[name] for o in outcomes if name in o.seconds]
        if times:
            words.append(f"{name} {np.median(times):.1f} s (longest {max(times):.1f})")
    return "median seconds: " + ", ".join(words)


def confusion(outcomes: Sequence[Outcome]) -> list[str]:
    """True kind × named kind, by counts; a name through its alias set stands as the truth."""
    rows: dict[str, Counter[str]] = {}
    for o in outcomes:
        if o.error:
            rows.setdefault(o.kind or o.group, Counter())["(error)"] += 1
            continue
        truths = [p["kind"] for p in o.planted] or ["(clean)"]
        for truth, right in zip(truths, o.score["found"] or [False], strict=True):
            row = rows.setdefault(truth, Counter())
            if right:
                row["absorbed" if o.absorbed and not _names(o, truth) else "right"] += 1
            wrong = [f for f in o.found if f["verdict"] == "wrong"]
            row.update(f["kind"] for f in wrong)
            row.update("extra:" + f["kind"] for f in o.found if f["verdict"] == "extra")
            if not right and not wrong:
                row["(unexplained)" if o.score["unexplained_there"] else "(nothing)"] += 1
    return [
        f"{truth:28} " + ", ".join(f"{name} {count}" for name, count in row.most_common())
        for truth, row in sorted(rows.items())
    ]


def _names(o: Outcome, kind: str) -> bool:
    return any(f["kind"] == kind or any(a["kind"] == kind for a in f["aliases"]) for f in o.found)


def _count(flags: Iterable[bool]) -> int:
    return sum(map(bool, flags))


def in_detail(judged: Judged) -> str:
    """All that is known of one case."""
    o, found = judged.outcome, judged.diagnosis
    text = [HEADER, line(o), f"encoder {o.encoder:.2e} rad, tracking {1e3 * o.tracking:.2f} mrad"]
    text += [f"planted: {p}" for p in o.planted] + [f"finding: {f}" for f in o.findings]
    if o.error or found is None:
        return "\n".join([*text, o.error])
    for f in o.found:
        text.append(
            f"named ({f['verdict']}): {f['kind']}@{_where(f['joints'])} {f['shape']} "
            f"{[round(v, 5) for v in f['values']]} runs {f['runs']}: p {f['p_value']:.1e}, "
            f"share {f['share']:.3f}, gain {f['gain']:.3f}, aliases "
            + (", ".join(f"{a['kind']}@{_where(a['joints'])}" for a in f["aliases"]) or "none")
        )
    text += [f"unexplained: {u}" for u in o.unexplained]
    text += [f"absorbed: {a.kind}@{_where(a.joints)} left {a.left:.1e}" for a in found.absorbed]
    for r in found.rounds:
        text.append(f"round {r.index}: {r.verdict}")
        text += [
            f"    {s.effect.kind}@{_where(s.effect.joints)} {s.effect.shape} {s.effect.runs} "
            f"p {s.p_value:.1e} share {s.share_of_residual:.3f} gain {s.gain:.3f}: {s.verdict}"
            for s in r.suspects
        ]
    text += [f"processing: {name} = {value}" for name, value in found.processing.items()]
    names = found.joint_names
    text.append(f"{'joint':26} {'before':>8} {'after':>8} relative, moving")
    text += [
        f"{n:26} {found.before.relative_moving[n]:8.4f} {found.after.relative_moving[n]:8.4f}"
        for n in names
    ]
    text.append(f"mean before {o.before:.4f}, after {o.after:.4f}, oracle {o.oracle:.4f}")
    return "\n".join(text)
