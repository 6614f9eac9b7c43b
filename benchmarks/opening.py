"""Motion by motion: a fit's covariance replaces the prior, and the admissible set opens.

Each motion keeps its torque limits for every inertia that box and fit admit, is played on a MuJoCo
robot with other inertias, and all data so far are identified for the next one. Printed for every
motion: its condition number, how much of the torque limits the uncertainty takes (mean over
instants and joints), and the condition number of the motion that a known robot would allow.

Run: python -m benchmarks.opening [ur10] [talos_arms] [--motions 3] [--iterations 150]
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import CONFIGS
from benchmarks.robust_replay import motion_of, spec_of
from excite_cli.config.load import spec_as_yaml
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.identification.identify import identify
from excite_cli.robot.model import Array
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.store.fit_file import fit_knowledge, write_fit


def taken(robust: Problem, plain: Problem, coefficients: Array) -> float:
    """Share of the torque limits that the uncertainty takes along a motion, mean."""
    pair = [next(c for c in of.constraints if isinstance(c, JointTorque)) for of in (robust, plain)]
    states = robust.states(coefficients)
    margins = [constraint.margins(states) / constraint.scale for constraint in pair]
    return float(np.mean(margins[1] - margins[0]))


def run(name: str, motions: int, iterations: int) -> None:
    plain = build_problem(spec_of(name, iterations, False), CONFIGS)
    known = motion_of(plain)[1]
    print(f"{name}: the URDF taken for the truth, condition number {known:.2f}")
    spec, knowledge, played = spec_of(name, iterations, True), None, []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fit.h5"
        for index in range(1, motions + 1):
            robust = build_problem(spec, CONFIGS, knowledge)
            coefficients, number = motion_of(robust)
            print(
                f"  motion {index}, {'box and fit' if knowledge else 'box'}: condition number "
                f"{number:.2f}; uncertainty takes "
                f"{100 * taken(robust, plain, coefficients):.2f} % of the torque limits",
                flush=True,
            )
            played.append(PlannedMotion(f"motion_{index}", robust.trajectory, coefficients))
            dataset = simulate(robust.robot, played, SimulationSettings(inertia_error=0.05)).dataset
            found = identify(robust.robot, robust.base, dataset, robust.spec)
            text = spec_as_yaml(robust.spec)
            write_fit(path, found, text, folder, robust.robot.fingerprint())
            spec = spec_of(name, iterations, True, f"uncertainty.fit={path}")
            knowledge = fit_knowledge(spec, Path(folder))
            assert knowledge is not None
            knowledge = replace(knowledge, source=f"the first {index} motions")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=["ur10", "talos_arms"])
    parser.add_argument("--motions", type=int, default=3)
    parser.add_argument("--iterations", type=int, default=150)
    arguments = parser.parse_args()
    for name in arguments.configs:
        run(name, arguments.motions, arguments.iterations)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
