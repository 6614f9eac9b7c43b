"""Real robots, from the URDF alone: what a diagnosis finds, and the error before and after.

    python -m benchmarks.real_robots [--log tx40 … | --markdown docs/results.md]

Runs `excite diagnose` on the logs of `data/`, whose configs declare no effect, and prints the table
of docs/results.md; `--markdown` puts it between the marks of that page. Errors are relative, of the
torque on data that the fit never saw, mean over joints, where joints move. Published and data-sheet
values are those of the logs' authors. Four minutes of processor time.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import pages
from benchmarks.pages import MarkedPart, percent
from benchmarks.program import excite
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION

DATA = Path(__file__).parents[1] / "data"
PART = MarkedPart("real robots", "benchmarks.real_robots")
HEADS = ("log", "before", "after", "what was found")
_CAD = ("--set", "identification.inertias=cad")
_FRICTION = ("viscous_friction", "coulomb_friction", "asymmetric_friction")
_USELESS = ("torso_lift_joint", "arm_5_joint", "arm_6_joint", "arm_7_joint")
_SAID = {
    "lag": "speeds that lag",
    "mostly_constant": "wrist torques that are mostly zero",
    "torque_steps": "torques in steps",
    "torque_scale": "a torso torque in another unit",
}


class Answer:
    """What `excite diagnose --json` says."""

    def __init__(self, content: dict[str, Any]) -> None:
        self.content = content

    def joints(self, kind: str) -> list[str]:
        """Where effects of a kind were found, in the robot's order."""
        found = {"–".join(e["joints"]) for e in self.content["effects"] if e["kind"] == kind}
        order = list(self.content["error"]["after"]["relative_moving"])
        return sorted(found, key=lambda name: order.index(name.split("–")[0]))

    def value(self, kind: str, parameter: str, *joints: str) -> float:
        """A parameter of an effect; not a number where the effect was not found."""
        for effect in self.content["effects"]:
            if effect["kind"] == kind and effect["joints"] == list(joints):
                return float(effect["parameters"][parameter]["value"])
        return float("nan")

    def line(self, name: str, joint: str) -> float:
        """`viscous` or `coulomb` of a joint, as on a data sheet."""
        lines = {each["joint"]: each for each in self.content["friction_lines"]}
        return float(lines[joint][name]["value"]) if joint in lines else float("nan")

    def error(self, when: str) -> float:
        """Mean over the joints, `before` or `after`."""
        return float(self.content["error"][when]["mean_relative_moving"])


@dataclass(frozen=True)
class Log:
    """A recording, how it is diagnosed, and what is told of the answers; the first gives errors."""

    words: str
    folder: str
    file: str
    found: Callable[[Sequence[Answer]], str]
    runs: tuple[tuple[str, ...], ...] = ((),)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--log", nargs="+", choices=sorted({log.folder for log in LOGS}))
    parser.add_argument("--markdown", type=Path, help="put the table between the marks there")
    arguments = parser.parse_args()
    if arguments.log and arguments.markdown:
        parser.error("--markdown takes the whole table: leave --log out")
    rows = []
    for log in LOGS:
        if not arguments.log or log.folder in arguments.log:
            answers = [diagnosed(log, options) for options in log.runs]
            rows.append(row(log, answers))
            print(" | ".join(rows[-1]), flush=True)
    if arguments.markdown is not None:
        PART.write(arguments.markdown, table(rows))


def diagnosed(log: Log, options: Sequence[str]) -> Answer:
    """The answer of `excite diagnose`, by the program in a process of its own."""
    folder = DATA / log.folder
    asked = ("diagnose", folder / f"{log.folder}.yaml", folder / log.file, *options)
    # 1: the held-out error did not fall, which the table shows
    answer = excite(*asked, "--json", "--no-progress", good=(0, 1)).answer
    return Answer(answer)


def row(log: Log, answers: Sequence[Answer]) -> tuple[str, ...]:
    """Cells of the table."""
    first = answers[0]
    return (log.words, percent(first.error("before")), percent(first.error("after")),
            log.found(answers))  # fmt: skip


def tx40(answers: Sequence[Answer]) -> str:
    """Beside the published friction of every joint and of the wrist's coupled motors."""
    (answer,) = answers
    sheets = {"viscous": (8.05, 5.53, 1.97, 1.11, 1.86, 0.65),
              "coulomb": (7.14, 8.26, 6.34, 2.48, 3.03, 0.28)}  # fmt: skip
    published = {
        f"{name} of joint_{j}": answer.line(name, f"joint_{j}") / value
        for name, values in sheets.items()
        for j, value in enumerate(values, 1)
    } | {
        f"{name} of the coupled wrist": answer.value(
            "coupled_friction", name, "joint_5", "joint_6"
        ) / value
        for name, value in (("viscous", 0.616), ("coulomb", 1.95))
    }  # fmt: skip
    far = [f"{what}: {percent(abs(ratio - 1))} off"
           for what, ratio in published.items() if not abs(ratio - 1) <= 0.1]  # fmt: skip
    rest = f" ({', '.join(far)})" if far else ""
    return (
        f"{friction(answer)}; coupled friction of {told(answer.joints('coupled_friction'))}; "
        f"{len(published) - len(far)} of {len(published)} published friction values within 10 %"
        f"{rest}"
    )


def ur10(answers: Sequence[Answer]) -> str:
    """Offsets, friction that saturates, friction that grows with load."""
    (answer,) = answers
    return (
        f"{friction(answer)}; torque offset of {told(answer.joints('torque_offset'))}; friction "
        f"concave in speed on {told(answer.joints('nonlinear_viscous_friction'))}; "
        f"load-dependent on {told(answer.joints('load_dependent_friction'))}"
    )


def kr300(answers: Sequence[Answer]) -> str:
    """All inertias free: what takes the spring's place is told."""
    (answer,) = answers
    by = [each["by"] for each in answer.content["absorbed"]
          if each["kind"] == "spring" and each["joints"] == ["axis_2"]]  # fmt: skip
    offsets = answer.joints("torque_offset")
    return (
        f"{friction(answer)}; armature of {told(answer.joints('armature'))}; "
        f"{'offset of ' + told(offsets) if offsets else 'no offset'}; a spring on axis_2 "
        + (f"would be absorbed by {told(by[0])}" if by else "is not said to be absorbed")
    )


def kr300_cad(answers: Sequence[Answer]) -> str:
    """The spring over the three splits, and the armatures of the data sheet."""
    every = [answer.value("spring", "stiffness", "axis_2") / 1e3 for answer in answers]
    stiffness = sorted(each for each in every if each == each) or [float("nan")]
    named = "" if len(stiffness) == len(every) else f"{len(stiffness)} of "
    spread = " to ".join(dict.fromkeys(f"{each:.1f}" for each in (stiffness[0], stiffness[-1])))
    sheet = {"axis_2": 844.0, "axis_3": 751.0}
    worst = max(abs(answer.value("armature", "inertia", axis) / value - 1)
                for answer in answers for axis, value in sheet.items())  # fmt: skip
    return (
        f"the hydraulic spring of axis_2, {spread} kN·m/rad "
        f"over {named}the {len(answers)} splits (about 7 known); armatures of {told(list(sheet))} "
        f"within {percent(worst)} of the data sheet"
    )


def tiago(answers: Sequence[Answer]) -> str:
    """What is said of the data, and what is named on the joints whose constants are known."""
    (answer,) = answers
    errors = answer.content["error"]["after"]["relative_moving"]
    known = {joint: percent(errors[joint]) for joint in (f"arm_{j}_joint" for j in (2, 3, 4))}
    said = {each["kind"] for each in answer.content["findings"]} & set(_SAID)
    named = [f"{each['kind'].replace('_', ' ')} of {told(each['joints'])}"
             for each in answer.content["effects"]]  # fmt: skip
    return (
        f"told of the data: {told([_SAID[kind] for kind in _SAID if kind in said])}; "
        f"named: {told(named)}. {told(list(known))}, whose torque constants are known, come to "
        f"{told(list(known.values()))}"
    )


def beside_textbook(answers: Sequence[Answer]) -> str:
    """The textbook's error, and what was named beside friction, offset and armature."""
    (answer,) = answers
    textbook = answer.content["error"]["textbook"]["mean_relative_moving"]
    more = {each["kind"]: None for each in answer.content["effects"]}
    named = [
        f"{kind.replace('_', ' ')} of {told(answer.joints(kind))}"
        for kind in more
        if kind not in (*EVERYDAY_FRICTION, *EVERYDAY)
    ]
    return f"{friction(answer)}; {told(named)}; the textbook's model leaves {percent(textbook)}"


LOGS = (
    Log("Stäubli TX40, 9 s, every third second held out", "tx40", "tx40.h5", tx40),
    Log("UR10 (CB3), 27 s, from the rosbag", "ur10_cb", "ur10_exciting_trajectory.db3", ur10),
    Log("KUKA KR300, run C held out, inertias free", "kr300", "kr300.h5", kr300,
        (("--held-out", "C"),)),
    Log("the same, inertias kept at CAD within 10 %", "kr300", "kr300.h5", kr300_cad,
        tuple(("--held-out", run, *_CAD) for run in "CBA")),
    Log("TIAGo, torso and arm, 80 s, currents with assumed constants", "tiago", "tiago.h5", tiago),
    Log("the same, without the four torques that are warned of", "tiago", "tiago.h5", tiago,
        (("--set", f"measurement.without_torque=[{','.join(_USELESS)}]"),)),
    Log("KUKA Med 7, 16 s that hardly excite", "med7", "med7.h5", beside_textbook),
    Log("Unitree Go2, legs in the air, 23 s, torque by its drives' law", "go2", "go2.h5",
        beside_textbook),
)  # fmt: skip


def friction(answer: Answer) -> str:
    """Where viscous and dry friction were found, and where this differs by direction."""
    everywhere = list(answer.content["error"]["after"]["relative_moving"])
    viscous, dry, one_sided = (answer.joints(kind) for kind in _FRICTION)
    both = [j for j in everywhere if j in viscous and (j in dry or j in one_sided)]
    if not both:
        return f"viscous friction on {told(viscous)}, Coulomb friction on {told(dry)}"
    where = "all joints" if both == everywhere else told(both)
    return f"friction on {where}" + f" (asymmetric on {told(one_sided)})" * bool(one_sided)


def told(names: Sequence[str]) -> str:
    """`a, b and c`; `none`."""
    if not names:
        return "none"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def table(rows: Sequence[Sequence[str]]) -> str:
    """The rows under their heads."""
    return pages.table(HEADS, rows)


if __name__ == "__main__":
    main()
