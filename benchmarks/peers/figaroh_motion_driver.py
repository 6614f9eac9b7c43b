"""FIGAROH's optimal trajectory of a robot, run by FIGAROH's own interpreter and nothing else.

    python figaroh_motion_driver.py request.json answer.npz

This file imports FIGAROH, cyipopt, Pinocchio and NumPy only: it is started as a program of its own,
so that FIGAROH may live in another environment, and apart from its identification, whose processor
time counts from the start of Python. FIGAROH is not changed: its problem class is
subclassed to note, at every point that IPOPT asks for, the time, the value and the point. What was
noted is judged afterwards by FIGAROH's own functions, off the clock.

The clock starts when IPOPT starts. Imports, the robot, base parameters and the search for a random
start are not counted.
"""

import json
import logging
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from figaroh.optimal.base_optimal_trajectory import (
    BaseOptimalTrajectory,
    BaseTrajectoryIPOPTProblem,
)
from figaroh.tools.robot import load_robot

# Bounds may be missed by this much [rad, rad/s, N·m, m]: a thousand times FIGAROH's own tolerance.
LENIENT = 1e-3
CONTROLLER_RATE = 1000.0


class TimedProblem(BaseTrajectoryIPOPTProblem):
    """FIGAROH's problem, with a note of every point that is not a probe of its differences."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.notes: list[tuple[float, float, float, np.ndarray]] = []
        self.began: tuple[float, float] | None = None
        self.limit = np.inf
        self._probing = False

    def objective(self, X: np.ndarray) -> float:
        value = float(super().objective(X))
        if self.began is not None and not self._probing:
            wall = time.perf_counter() - self.began[0]
            self.notes.append((wall, time.process_time() - self.began[1], value, np.array(X)))
        return value

    def intermediate(self, *arguments: Any, **named: Any) -> bool:
        """FIGAROH's own bookkeeping; False, which ends IPOPT, once the time is up."""
        going_on = super().intermediate(*arguments, **named)
        if self.began is not None and time.process_time() - self.began[1] > self.limit:
            return False
        return going_on is None or bool(going_on)

    def gradient(self, X: np.ndarray) -> np.ndarray:
        self._probing = True
        try:
            return np.asarray(super().gradient(X))
        finally:
            self._probing = False

    def solve_with_waypoints(self, wps: np.ndarray) -> tuple[bool, dict[str, Any]]:
        self.before = time.process_time()
        self.began = (time.perf_counter(), self.before)
        try:
            return super().solve_with_waypoints(wps)
        finally:
            self.wall = time.perf_counter() - self.began[0]
            self.processor = time.process_time() - self.began[1]
            self.began = None


class TimedTrajectory(BaseOptimalTrajectory):
    """FIGAROH's generator; keeps the problem that it solved."""

    problem: TimedProblem | None = None
    limit = np.inf

    def create_ipopt_problem(self, *arguments: Any) -> TimedProblem:
        self.problem = TimedProblem(self, *arguments)
        self.problem.limit = self.limit
        return self.problem


def main() -> None:
    logging.disable(logging.WARNING)
    asked = Path(sys.argv[1])
    answer = solve(json.loads(asked.read_text()), asked.with_name("figaroh.yaml"))
    np.savez(sys.argv[2], **answer)


def solve(request: dict[str, Any], config: Path) -> dict[str, Any]:
    """One segment from one random start, and what became of it; `config` is written for FIGAROH."""
    write_config(request, config)
    robot = load_robot(request["urdf"], package_dirs=request["package_dirs"], load_by_urdf=True)
    set_limits(robot.model, request)
    if not request["self_collision"]:
        robot.geom_model = None
    np.random.seed(request["seed"])  # noqa: NPY002 - it is what FIGAROH draws from
    generator = TimedTrajectory(robot, request["joints"], str(config))
    generator.limit = request["seconds"]
    joints = [robot.model.joints[robot.model.getJointId(name)] for name in request["joints"]]
    generator.identif_config["act_idxq"] = [joint.idx_q for joint in joints]
    generator.identif_config["act_idxv"] = [joint.idx_v for joint in joints]
    generator.initialize()
    results = generator.solve(stack_reps=1)
    return judged(generator, bool(results["T_F"]), request)


def set_limits(model: pin.Model, request: dict[str, Any]) -> None:
    """The limits of the example's URDF, whatever the URDF says."""
    for name, limit in request["limits"].items():
        joint = model.joints[model.getJointId(name)]
        model.lowerPositionLimit[joint.idx_q] = limit["position"][0]
        model.upperPositionLimit[joint.idx_q] = limit["position"][1]
        model.velocityLimit[joint.idx_v] = limit["velocity"]
        model.effortLimit[joint.idx_v] = limit["effort"]


def write_config(request: dict[str, Any], path: Path) -> None:
    """FIGAROH's config (JSON is YAML)."""
    parts = dict.fromkeys(("friction", "joint_offset", "actuator_inertia"), False)
    problem = {"use_joint_torques": True, "include_external_forces": False}
    motion = {name: request[name] for name in ("problem", "trajectory")}
    tasks = {
        "identification": {"enabled": True, "problem": problem | {"model_components": parts}},
        "optimal_trajectory": {"enabled": True, **motion},
    }
    joints = {"joints": {"active_joints": request["joints"]}}
    path.write_text(json.dumps({"tasks": tasks, "robot": {"name": "ur10", "properties": joints}}))


def judged(generator: TimedTrajectory, accepted: bool, request: dict[str, Any]) -> dict[str, Any]:
    """Improving points that keep FIGAROH's constraints, and the best of them in full.

    `claimed_`: with meshes looked at where its optimiser looks at them only.
    """
    problem = generator.problem
    assert problem is not None
    columns = request["columns"]
    kept, best = improving(problem, request["self_collision"], columns)
    claimed, best_claimed = improving(problem, False, columns)
    answer: dict[str, Any] = {
        "curve": kept,
        "claimed_curve": claimed,
        "found": np.array(accepted),
        "wall": np.array(problem.wall),
        "processor": np.array(problem.processor),
        "processor_before": np.array(problem.before),
        "start_is_clear": np.array(starts_clear(problem)),
        "eliminated": np.asarray(generator.idx_e),
        "base": np.asarray(generator.idx_b),
    }
    for prefix, x in (("", best), ("claimed_", best_claimed)):
        for name, rate in (("sample", None), ("fine", CONTROLLER_RATE)):
            if x is not None:
                found = states(problem, x, rate)
                answer |= {f"{prefix}{name}_{key}": value for key, value in found.items()}
    return answer


def improving(
    problem: TimedProblem, clear: bool, columns: list[int]
) -> tuple[np.ndarray, np.ndarray | None]:
    """Points that keep FIGAROH's bounds and improve by its columns or by `columns`; the best.

    Rows are wall and processor time, and the condition number by either; best is by FIGAROH's.
    With `clear` the whole motion must be clear as FIGAROH checks it in the end (200 Hz, its
    margin); without, meshes are only looked at where its optimiser does.
    """
    kept: list[tuple[float, float, float, float]] = []
    best, lowest, lowest_other = None, np.inf, np.inf
    for wall, processor, value, x in problem.notes:
        if not problem._is_feasible(x, LENIENT):
            continue
        other = condition_number(problem, x, columns)
        if value >= lowest and other >= lowest_other:
            continue
        if clear and not problem._is_collision_free(x):
            continue
        kept.append((wall, processor, value, other))
        lowest_other = min(lowest_other, other)
        if value < lowest:
            lowest, best = value, x
    return np.array(kept).reshape(-1, 4), best


def condition_number(problem: TimedProblem, x: np.ndarray, columns: list[int]) -> float:
    """Of other columns of the regressor, by Pinocchio, over FIGAROH's own samples."""
    model, found = problem.opt_traj.robot.model, states(problem, x, None)
    data = model.createData()
    rows = [
        pin.computeJointTorqueRegressor(model, data, *state)[:, columns].copy()
        for state in zip(found["q"], found["v"], found["a"], strict=True)
    ]
    return float(np.linalg.cond(np.vstack(rows)))


def starts_clear(problem: TimedProblem) -> bool:
    """Whether the random start keeps clear of itself (always so when that is not asked for)."""
    return bool(problem._is_collision_free(np.asarray(problem.get_initial_guess())))


def states(problem: TimedProblem, x: np.ndarray, rate: float | None) -> dict[str, np.ndarray]:
    """t, q, v, a of the waypoints x, at FIGAROH's own rate or another [Hz]."""
    generator = problem.opt_traj
    waypoints = np.vstack((problem.wp_init, x.reshape(problem.n_wps - 1, problem.n_joints)))
    t, q, v, a = generator.CB.get_full_config(
        rate or generator.trajectory_config["freq"],
        problem.tps,
        waypoints.T,
        problem.vel_wps,
        problem.acc_wps,
    )
    return {"t": np.asarray(t).ravel(), "q": q, "v": v, "a": a}


if __name__ == "__main__":
    main()
