"""Does the proposed next motion settle what a diagnosis left open? Through the installed program.

    python -m benchmarks.next_motion [CASE…]

A slow motion is played three times on a simulated robot that has a small effect; the diagnosis
names an effect together with others that the data cannot tell from it. `optimize --after` plans
the motion that tells them apart, the same robot plays it once, and both files are diagnosed
together, an old take held out. Divergences are in nats: 3 is where two effects count as told apart.

Over the seeds 1 to 5 of `simulate` (the sizes were chosen so that the first data leave it open):
nonlinear: 5 of 5 start with an alias set that holds the truth, or the truth named; 5 of 5 settled.
coulomb: 4 of 5 start so (seed 1 is named right at once); 4 of 4 settled.
panda: 5 of 5 start so; 4 of 5 settled (seed 1: right name, a new alias, stribeck_friction).
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
HELD_OUT = "motion_1_take_3"
# One start and few iterations: a motion that separates need not be the best one.
_BRIEF = ("optimizer.restarts=1", "optimizer.max_iterations=60")


@dataclass(frozen=True)
class Case:
    """A robot, the effect that is put into it, and how its first motion is held back.

    `truth` as `simulate --effect` takes it; `kind` and `joint` are the right answer. Friction that
    the robot's model declares is there besides, in sizes of its own.
    """

    config: str
    truth: str
    kind: str
    joint: str
    slow: tuple[str, ...] = ("constraints.joint_limits.scale=0.15",)
    simulated: tuple[str, ...] = ("--torque-noise", "0.03", "--seed", "2")


CASES = {
    "nonlinear": Case(
        "smoke.yaml", "nonlinear_viscous_friction@elbow=0.12,power:2",
        "nonlinear_viscous_friction", "elbow", simulated=("--torque-noise", "0.03", "--seed", "1"),
    ),
    "coulomb": Case(
        "smoke.yaml", "coulomb_friction@elbow=0.05", "coulomb_friction", "elbow"
    ),
    "panda": Case(
        "panda.yaml", "coulomb_friction@panda_joint4=0.1", "coulomb_friction", "panda_joint4",
        ("constraints.joint_limits.scale=0.1",), ("--torque-noise", "0.02", "--seed", "2"),
    ),
}  # fmt: skip


@dataclass
class Outcome:
    """Effects named first, the outlook of every pair, effects named in the end."""

    first: list[dict[str, Any]]
    pairs: list[dict[str, Any]]
    last: list[dict[str, Any]]
    seconds: dict[str, float] = field(default_factory=dict)

    def settled(self, case: Case) -> bool:
        """Ambiguous at first; in the end the right effect alone, without an alias."""
        right = [f"{case.kind} on {case.joint}"]
        alone = [_short(e) for e in self.last] == right and not self.last[0]["alias_set"]
        return bool(self.pairs) and alone


class Program:
    """The installed `excite`, run in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        beside = f"{Path(sys.executable).parent}{os.pathsep}{os.defpath}"
        found = shutil.which("excite", path=beside)
        call = "from excite_cli.cli.app import main; main()"
        self.command = [found] if found else [sys.executable, "-c", call]

    def __call__(self, *arguments: str | Path) -> Any:
        """What `--json` prints. Raises RuntimeError with the program's words."""
        run = subprocess.run(
            [*self.command, *map(str, arguments), "--json", "--no-progress"],
            cwd=self.folder,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        if run.returncode:
            raise RuntimeError(f"excite {' '.join(map(str, arguments))}: {run.stderr}")
        return json.loads(run.stdout)


def run_loop(case: Case, folder: Path) -> Outcome:
    """The whole loop in `folder`."""
    excite, config = Program(folder), ROOT / "configs" / case.config
    brief = _given("--set", _BRIEF)
    simulated = ["--effect", case.truth, *case.simulated]
    seconds: dict[str, float] = {}

    def timed(name: str, *arguments: str | Path) -> Any:
        started = time.monotonic()
        answer = excite(*arguments)
        seconds[name] = time.monotonic() - started
        return answer

    timed(
        "first", "optimize", config, "-o", "slow.h5", "--motions", "1",
        *brief, *_given("--set", case.slow),
    )  # fmt: skip
    timed("play", "simulate", config, "slow.h5", "-o", "slow_data.h5", "--repeat", "3", *simulated)
    first = timed("diagnose", "diagnose", config, "slow_data.h5", "-o", "first.h5")
    following = timed(
        "next", "optimize", config, "--after", "first.h5", "-o", "next.h5", "--motions", "1", *brief
    )
    timed("play next", "simulate", config, "next.h5", "-o", "next_data.h5", *simulated)
    last = timed(
        "diagnose both", "diagnose", config, "slow_data.h5", "next_data.h5", "--held-out", HELD_OUT,
        "-o", "both.h5",
    )  # fmt: skip
    pairs = following["next_experiment"]["pairs"]
    return Outcome(first["effects"], pairs, last["effects"], seconds)


def measured_divergence(case: Case, folder: Path, pair: tuple[str, str]) -> float:
    """How much better the true one of two kinds explains all training data than the other [nats].

    ½ (χ²_true − χ²_other) of each alone beside the declared model, inflation taken off; negative
    if the data speak for the wrong one.
    """
    from excite_cli.config.load import load_spec
    from excite_cli.diagnosis.search_loop import Model, trace
    from excite_cli.dynamics.base_parameters import find_base_parameters
    from excite_cli.effects.catalogue import declared_effects
    from excite_cli.identification.declared_states import LeftOut
    from excite_cli.identification.prepare import PreparedRun, prepare
    from excite_cli.identification.processing import choose_processing
    from excite_cli.identification.split import split
    from excite_cli.measurement.catalogue import read_dataset
    from excite_cli.robot.model import build_robot

    config = ROOT / "configs" / case.config
    spec = load_spec(config, [f"diagnosis.kinds=[{', '.join(pair)}]"])
    robot = build_robot(spec.robot, config.parent)
    files = [folder / "slow_data.h5", folder / "next_data.h5"]
    limits = robot.limits
    data = read_dataset(
        files,
        spec.measurement,
        robot.joint_names,
        (limits.lower, limits.upper, limits.velocity, limits.effort),
        (~robot.sliding).astype(float),
    )
    parts = split(data, HELD_OUT)
    processing = choose_processing(
        parts.training, spec.measurement.filter, spec.diagnosis.moving_speed
    )

    def prepared(left_out: LeftOut) -> list[PreparedRun]:
        return [prepare(run, processing, left_out) for run in parts.training]

    model = Model(robot, find_base_parameters(robot), declared_effects(spec.effects, robot), None)
    names = [run.name for run in data.runs]
    traced = trace(model, spec.diagnosis, prepared, parts.folds, names, lambda text, done: None)
    alone = traced.judge.white.schur(()).singles
    best = {
        kind: max(
            alone[i].chi2
            for i, c in enumerate(traced.candidates)
            if c.effect.kind == kind
            and [robot.joint_names[j] for j in c.effect.joints] == [case.joint]
        )
        for kind in pair
    }
    other = next(kind for kind in pair if kind != case.kind)
    return 0.5 * (best[case.kind] - best[other]) / traced.inflation


def report(name: str, case: Case, folder: Path) -> bool:
    """Run a case and print it; whether the right name stands alone in the end."""
    outcome = run_loop(case, folder)
    print(f"{name}: {case.config}, truth {case.truth}")
    for effect in outcome.first:
        aliases = ", ".join(_short(alias) for alias in effect["alias_set"]) or "none"
        print(f"  first diagnosis: {_short(effect)}; indistinguishable from: {aliases}")
    for pair in outcome.pairs:
        kinds = tuple(pair[side].split(" on ")[0] for side in ("effect", "alias"))
        text = "neither is the truth"
        if case.kind in kinds:
            found = measured_divergence(case, folder, (kinds[0], kinds[1]))
            text = f"measured {found:.1f} for the truth"
        print(
            f"  {kinds[0]} / {kinds[1]}: divergence {pair['kl_so_far']:.2f}, with the next motion "
            f"expected {pair['expected_kl']:.1f}, {text}"
        )
    for effect in outcome.last:
        aliases = ", ".join(_short(alias) for alias in effect["alias_set"]) or "none"
        values = ", ".join(f"{k} {v['value']:.4g}" for k, v in effect["parameters"].items())
        print(f"  in the end: {_short(effect)} ({values}); indistinguishable from: {aliases}")
    good = outcome.settled(case)
    spent = ", ".join(f"{step} {value:.0f}" for step, value in outcome.seconds.items())
    verdict = "from an alias set to the right name alone" if good else "NOT SETTLED"
    print(f"  {verdict}; seconds: {spent}", flush=True)
    return good


def main() -> int:
    """Run the cases named (default: all)."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    names = parser.parse_args().cases or list(CASES)
    if unknown := [name for name in names if name not in CASES]:
        parser.error(f"no case {', '.join(unknown)}; there are {', '.join(CASES)}")
    good = 0
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            good += report(name, CASES[name], Path(folder))
    print(f"{good} of {len(names)} go from an alias set to the right name alone")
    return int(good < len(names))


def _given(option: str, values: Sequence[str]) -> list[str]:
    return [part for value in values for part in (option, value)]


def _short(effect: dict[str, Any]) -> str:
    return f"{effect['kind']} on {', '.join(effect['joints'])}"


if __name__ == "__main__":
    sys.exit(main())
