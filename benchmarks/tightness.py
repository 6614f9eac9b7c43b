"""How near the worst-case margins are to the worst that an adversary finds.

Along a motion the worst torque (and the worst of the ground's functionals) over all admitted
inertias, as the constraints bound it, is compared with what an adversary reaches: over the box by
corners, over box and ellipsoid of a fit by the exact cone program, whose solution is an admitted
inertia. Printed is bound/worst − 1 at every instant's most loaded rows.

Run: python -m benchmarks.tightness [ur10] [panda]
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import clarabel
import numpy as np
from scipy.sparse import csc_matrix
from threadpoolctl import threadpool_limits

from benchmarks.problems import CONFIGS
from excite_cli.config.load import load_spec
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.uncertain_inertias import (
    FitKnowledge,
    InertiaUncertainty,
    inertia_uncertainty,
)
from excite_cli.dynamics.whole_robot import GroundWrench, whole_parameters
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.identification.identify import identify
from excite_cli.robot.model import Array
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import simulate
from excite_cli.store.fit_file import fit_knowledge, write_fit

UNCERTAIN = "uncertainty={mass: 0.1, center_of_mass: 0.01, inertia: 0.1}"
SIGMAS = 3.0
EVERY = 25  # constraint samples


def corner(y: Array, center: Array, reach: Array) -> float:
    """The largest y·φ over the box, by trying each parameter at both ends."""
    phi = center.copy()
    for index in range(len(y)):
        ends = [center[index] - reach[index], center[index] + reach[index]]
        phi[index] = max(ends, key=lambda value: y[index] * value)
    return float(y @ phi)


def cone(y: Array, center: Array, reach: Array, mapping: Array, fit: FitKnowledge) -> float:
    """The largest y·φ over box and ellipsoid."""
    used = np.flatnonzero(reach > 0)
    shown = np.isfinite(np.diag(fit.covariance))  # the rest is left to the box
    size, values, mapping = len(used), fit.values[shown], mapping[shown]
    covariance = fit.covariance[np.ix_(shown, shown)]
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    rows = np.vstack(
        [np.eye(size), -np.eye(size), np.zeros((1, size)), -whiten @ (mapping * reach)[:, used]]
    )
    right = np.concatenate([np.ones(2 * size), [SIGMAS], whiten @ (mapping @ center - values)])
    cones = [clarabel.NonnegativeConeT(2 * size), clarabel.SecondOrderConeT(len(values) + 1)]
    quiet = clarabel.DefaultSettings()
    quiet.verbose = False
    zero, goal = csc_matrix((size, size)), -(y * reach)[used]
    solver = clarabel.DefaultSolver(zero, goal, csc_matrix(rows), right, cones, quiet)
    found = solver.solve()
    if "Solved" not in str(found.status):
        print(f"  (the cone program ended with {found.status})")
    return float(y @ center - found.obj_val)


def told(words: str, admitted: InertiaUncertainty, y: Array, worst: list[float]) -> None:
    bound = -admitted.least(-y)
    over = bound / np.array(worst) - 1.0
    print(
        f"  {words:34} {len(y):4} rows   median {100 * np.median(over):6.3f} %   "
        f"largest {100 * over.max():6.3f} %",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=["ur10", "panda"])
    for name in parser.parse_args().configs:
        brief = [UNCERTAIN, "sequence.motions=1", "optimizer.max_iterations=60",
                 "optimizer.restarts=1"]  # fmt: skip
        spec = load_spec(CONFIGS / f"{name}.yaml", brief)
        problem = build_problem(spec, CONFIGS)
        robot, base = problem.robot, problem.base
        result = continue_run(
            problem, new_result(problem, [], {}), lambda i: lambda p: None, lambda s, c: None
        )
        alpha = result.motions[0].coefficients
        planned = PlannedMotion("1", problem.trajectory, alpha)
        data = simulate(robot, [planned], SimulationSettings()).dataset
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "fit.h5"
            found = identify(robot, base, data, spec)
            write_fit(path, found, result.config, folder, robot.fingerprint())
            narrow = load_spec(CONFIGS / f"{name}.yaml", [*brief, f"uncertainty.fit={path}"])
            fit = fit_knowledge(narrow, Path(folder))
        assert narrow.uncertainty is not None
        assert fit is not None
        prior = inertia_uncertainty(narrow.uncertainty, robot, base)
        after = inertia_uncertainty(narrow.uncertainty, robot, base, fit)
        states = problem.states(alpha)
        some = slice(None, None, EVERY)
        q, v, a = states.q[some], states.v[some], states.a[some]
        torque = Regressor(replace(robot, rows=robot.moved)).evaluate(q, v, a)
        torque = np.pad(torque, ((0, 0), (0, 0), (10, 0)))
        ground = GroundWrench(robot).regressor(states)[some, 2:3]
        phi, mapping = whole_parameters(robot), np.pad(base.mapping, ((0, 0), (10, 0)))
        print(name)
        for words, rows in (("torque", torque), ("load on the ground", ground)):
            y = rows.reshape(-1, rows.shape[-1])
            y = y * np.sign(y @ phi)[:, None]
            size = y @ phi
            y = y[size > 0.2 * size.max()]
            box = after.pieces[0]
            told(
                f"{words}, box", prior, y, [corner(row, phi, prior.pieces[0].corners) for row in y]
            )
            worst = [cone(row, box.center, box.corners, mapping, fit) for row in y]
            told(f"{words}, box and fit", after, y, worst)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
