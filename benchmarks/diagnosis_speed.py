"""Where the processor time of a diagnosis goes, and how it grows with samples and joints.

Run: python -m benchmarks.diagnosis_speed [ROBOT]   (ur10, panda or talos_arms; default: panda)

A robot with load-dependent friction plays four motions in MuJoCo and is diagnosed: one, two and
four periods of each, and with half of its joints. Times are of the processor. Stages include what
they call, so they overlap a little (columns ask for derivatives of the rigid body).
Exponents are fitted: time grows with samples^a and joints^b.
"""

import cProfile
import json
import os
import pstats
import resource
import sys
import time

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.battery.motions import CONFIGS, ROBOTS, pool, trajectory
from excite_cli.config.load import load_spec
from excite_cli.diagnosis.diagnose import diagnose
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.effects.catalogue import declared_effects
from excite_cli.robot.model import build_robot
from excite_cli.simulation.ground_truth import parse_planted
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate

# Name, file and function of each stage.
STAGES = (
    ("filters", "prepare.py", "prepare"),
    ("order and signs of the data", "plausibility.py", "check_plausibility"),
    ("derivatives of the rigid body", "rigid_body.py", "_derivatives"),
    ("search of gaps (backlash)", "backlash.py", "tuned"),
    ("search of lines (ripple)", "ripple.py", "tuned"),
    ("columns, filtered", "candidates.py", "with_columns"),
    ("Gram matrices", "training.py", "evidence"),
    ("noise", "noise_model.py", "fit_noise"),
    ("placebos", "placebo.py", "inflation_of"),
    ("search over sets", "search.py", "run"),
    ("what is left", "large_rest.py", "large_rests"),
    ("rounds", "rounds.py", "rounds_of"),
)


class Case:
    """A robot with its first `joints`, and data of `periods` of four motions."""

    def __init__(self, name: str, joints: int, periods: int) -> None:
        path = CONFIGS / f"{name}.yaml"
        names = build_robot(load_spec(path, []).robot, path.parent).joint_names[:joints]
        moved = [f"robot.joints={json.dumps(names)}", "robot.posture={}"]
        self.spec = load_spec(path, moved if joints < pool(name, 1)[0].shape[1] else [])
        self.robot = build_robot(self.spec.robot, path.parent)
        self.base = find_base_parameters(self.robot)
        motions = [
            PlannedMotion(f"motion_{k}", trajectory(), coefficients[:, :joints])
            for k, coefficients in enumerate(pool(name, 1)[:4], start=1)
        ]
        planted = parse_planted(
            f"load_dependent_friction@{names[joints // 2]}=0.06",
            self.robot,
            {"motion_1": ("motion_1",)},
        )
        declared = declared_effects(self.spec.effects, self.robot)
        settings = SimulationSettings(periods=periods)
        self.dataset = simulate(self.robot, motions, settings, planted, declared).dataset
        self.samples = sum(len(run.t) for run in self.dataset.runs)

    def run(self) -> str:
        """Diagnose; what was found, in a few words."""
        found = diagnose(self.robot, self.base, self.dataset, self.spec)
        return ", ".join(f"{e.effect.kind}@{'+'.join(e.effect.joints)}" for e in found.effects)

    def seconds(self) -> float:
        """Of the processor."""
        began = time.process_time()
        self.run()
        return time.process_time() - began


def shares(case: Case) -> None:
    """Print the share of every stage."""
    profile = cProfile.Profile(time.process_time)
    found = profile.runcall(case.run)
    cumulative = {
        (os.path.basename(file), function): spent
        for (file, _, function), (_, _, _, spent, _) in pstats.Stats(profile).stats.items()
    }
    whole = cumulative["diagnosis_speed.py", "run"]
    print(f"\n{found or 'nothing'} found; shares of {whole:.1f} s under the profiler")
    for name, file, function in STAGES:
        spent = cumulative.get((file, function), 0.0)
        print(f"  {name:32} {spent:7.2f} s {100 * spent / whole:5.1f} %")


def exponent(sizes: list[int], seconds: list[float]) -> float:
    """Slope of log seconds over log size."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def main(name: str) -> None:
    joints = pool(name, 1)[0].shape[1]
    print(f"{name}\n{'joints':>6} {'samples':>8} {'seconds':>8}")

    def timed(joints: int, periods: int) -> tuple[Case, float]:
        case = Case(name, joints, periods)
        seconds = case.seconds()
        print(f"{joints:6} {case.samples:8} {seconds:8.2f}", flush=True)
        return case, seconds

    by_length = [timed(joints, periods) for periods in (1, 2, 4)]
    fewer = [timed(joints // 2, 1), by_length[0]]
    shares(by_length[0][0])
    a = exponent([case.samples for case, _ in by_length], [spent for _, spent in by_length])
    b = exponent([case.robot.n for case, _ in fewer], [spent for _, spent in fewer])
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"\ntime grows with samples^{a:.2f} and joints^{b:.2f}; {memory:.0f} MB at most")


if __name__ == "__main__":
    chosen = sys.argv[1] if len(sys.argv) > 1 else "panda"
    if chosen not in ROBOTS:
        sys.exit(f"robot: {chosen}; allowed: {', '.join(ROBOTS)}")
    with threadpool_limits(1):
        main(chosen)
