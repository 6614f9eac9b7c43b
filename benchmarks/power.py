"""Is the predicted power of planned motions that of the diagnosis? Effects of such sizes, planted.

    python -m benchmarks.power [--cases N] [--seed S] [--robots NAME …]

Motions are planned as `excite init` proposes it, a first look (--quick); every case plants one
effect, of a kind and on a joint that are drawn, with the size that the motions name with 20, 50, 80
or 95 %, in a MuJoCo robot whose inertias are 20 % off and whose torque noise is told to the config.
Printed is how many of them `excite diagnose` names, by predicted power.
"""

import argparse
import os
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from excite_cli import diagnose, load_problem, plan, simulate
from excite_cli.api.proposing import save_proposal
from excite_cli.diagnosis.expectation import expectation
from excite_cli.diagnosis.power import EffectPower, price, times_named
from excite_cli.effects.catalogue import catalogue, declared_effects
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.result import Result
from excite_cli.simulation.settings import SimulationSettings

POWERS = (0.20, 0.50, 0.80, 0.95)
ROBOTS = ("ur10", "panda", "kinova", "so100")
QUICK = ("optimizer.max_iterations=50", "optimizer.restarts=1", "constraints.surroundings=null")
# Of the RMS torque of a joint, white, and samples a second [Hz]: as 2 % in 20 samples a second.
NOISE, RATE = 0.1, 500.0


def planned(name: str, folder: Path) -> tuple[Problem, Result]:
    """Motions of a robot, in a config that says what the noise of its torques will be."""
    path = folder / f"{name}.yaml"
    save_proposal(f"example-robot-data:{name}", path, tell=lambda note: None)
    problem = load_problem(path, QUICK, tell=lambda note: None)
    quiet = SimulationSettings(rate=RATE, torque_noise=0.0, inertia_error=0.0)
    first = simulate(problem, plan(problem), (), quiet, tell=lambda note: None).dataset
    rms = np.mean([np.sqrt(np.mean(run.tau**2, axis=0)) for run in first.runs], axis=0)
    level = NOISE * rms * np.sqrt(problem.spec.task.rate / RATE)
    weights = ", ".join(
        f"{joint}: {1.0 / each:.6g}"
        for joint, each in zip(problem.robot.joint_names, level, strict=True)
    )
    told = [*QUICK, f"criterion.row_weights={{{weights}}}"]
    problem = load_problem(path, told, tell=lambda note: None)
    return problem, plan(problem)


def declared(problem: Problem) -> set[tuple[str, tuple[str, ...]]]:
    """What the model has already: friction of the URDF's <dynamics>."""
    robot = problem.robot
    return {
        (each.kind, tuple(robot.joint_names[j] for j in each.joints))
        for each in declared_effects(problem.spec.effects, robot)
    }


def sized(problem: Problem, shown: EffectPower, power: float) -> float:
    """The size of an effect that the motions name with this power."""
    cost = price(catalogue()[shown.kind], problem.spec.diagnosis.significance)
    return shown.size * times_named(cost, power) / times_named(cost, shown.power)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    given = parser.parse_args()
    named: dict[float, list[bool]] = {power: [] for power in POWERS}
    with tempfile.TemporaryDirectory() as folder:
        there = [planned(name, Path(folder)) for name in given.robots]
        shown = [
            [
                each
                for each in expectation(*one).power
                if each.share < 1 and (each.kind, each.joints) not in declared(one[0])
            ]
            for one in there
        ]
        for case in range(given.cases):
            rng = np.random.default_rng((given.seed, case))
            (problem, result), power = there[case % len(there)], POWERS[case // len(there) % 4]
            of = shown[case % len(there)]
            kind = str(rng.choice(sorted({each.kind for each in of})))
            among = [each for each in of if each.kind == kind]
            one = among[int(rng.integers(len(among)))]
            drawn, size = one.joints[0], sized(problem, one, power)
            told = expectation(problem, result, {kind: size}).power
            if abs(next(e.power for e in told if e.joints == one.joints) - power) > 0.01:
                continue  # so small that it does not matter, however surely it is there
            settings = SimulationSettings(rate=RATE, torque_noise=NOISE)
            changed = [f"seed={1000 * given.seed + case}"]
            own = load_problem(problem.file, [*QUICK, *changed], tell=lambda note: None)
            data = simulate(own, result, [f"{kind}@{drawn}={size:.9g}"], settings).dataset
            found = diagnose(own, data, tell=lambda note: None)
            hit = any((e.effect.kind, e.effect.joints) == (kind, (drawn,)) for e in found.effects)
            named[power].append(hit)
            others = [f"{e.effect.kind}@{'+'.join(e.effect.joints)}" for e in found.effects]
            print(f"{case:3d} {problem.robot.name} {kind}@{drawn} {size:.3g} at {power:.0%}: "
                  f"{'named' if hit else 'not named'}; {', '.join(others) or 'nothing'}",
                  flush=True)  # fmt: skip
    for power, hits in named.items():
        print(f"predicted {power:.0%}: named {np.mean(hits):.0%} of {len(hits)}")


if __name__ == "__main__":
    main()
