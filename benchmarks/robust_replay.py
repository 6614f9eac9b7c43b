"""Plain and robust limits against robots with other inertias, replayed in MuJoCo at 500 Hz.

One motion is sought with the limits for the URDF's inertias, one with limits for every inertia
within the stated bounds. Both are replayed on robots drawn within these bounds: physically
consistent ones, and corners of the box (any corner, and those that the two motions mind most).
Counted is how many robots break a limit. (`benchmarks.opening` shows the room that fits give back.)

Run: python -m benchmarks.robust_replay [--sets 200] [--iterations 150] [ur10] [talos_arms]
"""

import argparse
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.problems import CONFIGS
from benchmarks.whole_plant import WholePlant
from excite_cli.config.load import load_spec
from excite_cli.config.spec import Spec
from excite_cli.constraints.balance import Balance
from excite_cli.constraints.ground_contact import Contact, ZeroMomentPoint
from excite_cli.constraints.joint_torque import JointTorque
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.uncertain_inertias import box
from excite_cli.dynamics.whole_robot import whole_parameters
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.run import continue_run, new_result
from excite_cli.robot.model import Array

RATE = 500.0
# A replay counts as broken beyond this share of the limit; margins end at zero, not above it.
ROUNDING = 1e-9
SETTINGS = {
    "ur10": (
        "constraints.torque.scale=0.25",
        "uncertainty={mass: 0.1, center_of_mass: 0.01, inertia: 0.1}",
    ),
    "talos_arms": (
        "constraints.torque={scale: 0.4}",
        "constraints.balance={kind: disc, radius: 0.02}",
        "constraints.contact={vertices: [[-0.06, -0.05], [0.045, -0.05], [0.045, 0.05], "
        "[-0.06, 0.05]], height: -1.019, friction: 0.06, torsion: 0.012, min_load: 750}",
        "uncertainty={mass: 0.1, center_of_mass: 0.01, inertia: 0.1, bodies: {base: {mass: 0.05, "
        "center_of_mass: 0.003, inertia: 0.05}}}",
    ),
}
# Balance alone, in the paper's disc: the motion then uses all of it.
SETTINGS["talos_balance"] = (
    "constraints.self_collision=null",
    "uncertainty={mass: 0.05, center_of_mass: 0.003, inertia: 0.1, bodies: {base: {mass: 0.02, "
    "center_of_mass: 0.001, inertia: 0.05}}}",
)
FILES = {"talos_balance": "talos_arms"}
LIMITS = (JointTorque, Balance, ZeroMomentPoint, Contact)


@dataclass(frozen=True)
class Replay:
    """Smallest share left of each limit by its constraint's name, over robots (S,)."""

    shares: dict[str, Array]

    def broken(self, name: str, robots: slice) -> int:
        return int(np.count_nonzero(self.shares[name][robots] < -ROUNDING))


def spec_of(name: str, iterations: int, robust: bool, *overrides: str) -> Spec:
    settings = [s for s in SETTINGS[name] if robust or not s.startswith("uncertainty")]
    common = ["sequence.motions=1", f"optimizer.max_iterations={iterations}"]
    file = CONFIGS / f"{FILES.get(name, name)}.yaml"
    return load_spec(file, [*settings, *common, *overrides])


def motion_of(problem: Problem) -> tuple[Array, float]:
    result = continue_run(
        problem,
        new_result(problem, [], {}),
        lambda index: lambda progress: None,
        lambda step, current: None,
    )
    return result.motions[0].coefficients, result.motions[0].condition_number


def consistent_robots(problem: Problem, count: int, rng: np.random.Generator) -> Array:
    """φ (count, P) of real bodies within the box: heavier or lighter, and shifted.

    In a third of the robots all bodies are as heavy or light as they can be.
    """
    phi, reach = whole_parameters(problem.robot).reshape(-1, 10), _box(problem).reshape(-1, 10)
    found = np.empty((count, *phi.shape))
    for robot in range(count):
        common = rng.choice([-1.0, 1.0])
        for body, (ten, bound) in enumerate(zip(phi, reach, strict=True)):
            mass_share = bound[0] / ten[0] if ten[0] > 0 else 0.0
            share = mass_share * (common if robot % 3 == 0 else rng.uniform(-1, 1))
            shift = rng.uniform(-1, 1, 3) * (bound[1:4].max() / max(ten[0], 1e-9))
            scale = 1.0
            while True:
                candidate = shifted((1.0 + share) * ten, shift * scale)
                if np.all(np.abs(candidate - ten) <= bound * (1 + 1e-9)) or scale < 1e-6:
                    break
                scale *= 0.7
            found[robot, body] = candidate if scale >= 1e-6 else ten
    return found.reshape(count, -1)


def shifted(ten: Array, shift: Array) -> Array:
    """The body with its centre of mass moved by `shift` [m], the inertia about it kept."""
    mass, first = ten[0], ten[1:4]
    if mass <= 0:
        return ten

    def steiner(lever: Array) -> Array:
        full = lever @ lever * np.eye(3) - np.outer(lever, lever)
        return mass * full[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]

    lever = first / mass
    inertia = ten[4:] - steiner(lever) + steiner(lever + shift)
    return np.concatenate([[mass], mass * (lever + shift), inertia])


def corners(problem: Problem, states: States, count: int, rng: np.random.Generator) -> Array:
    """φ (about 2·count, P): random corners of the box, and the worst ones of the motion."""
    phi, reach = whole_parameters(problem.robot), _box(problem)
    found = [phi + rng.choice([-1.0, 1.0], (count, len(phi))) * reach]
    for constraint in problem.constraints:
        if isinstance(constraint, JointTorque):
            y = constraint._regressor.evaluate(states.q, states.v, states.a)[:, constraint._joints]
            y = np.pad(-constraint._signs[:, None] * y, ((0, 0), (0, 0), (10, 0)))
        elif isinstance(constraint, ZeroMomentPoint | Contact):
            y = constraint.functionals @ constraint.ground.wrench.regressor(states)
        else:
            continue
        margins = constraint.margins(states) / constraint.scale
        nearest = np.argsort(margins, axis=None)[:: max(margins.size // (50 * count), 1)][:count]
        t, column = np.unravel_index(nearest, margins.shape)
        found.append(phi - np.sign(y[t, column]) * reach)
    return np.vstack(found)


def _box(problem: Problem) -> Array:
    assert problem.spec.uncertainty is not None
    return box(problem.spec.uncertainty, problem.robot)


def replayed(problem: Problem, coefficients: Array, robots: Array) -> Replay:
    """Shares left of the limits of `problem` with MuJoCo's torques, wrenches and centres."""
    times = np.arange(0.0, problem.trajectory.duration, 1.0 / RATE)
    states = problem.states(coefficients, problem.trajectory.basis(times))
    plant = WholePlant(problem.robot)
    held = [c for c in problem.constraints if isinstance(c, LIMITS)]
    shares: dict[str, list[float]] = {constraint.name: [] for constraint in held}
    for phi in robots:
        plant.set_inertias(phi)
        torque, wrench, center = plant.inverse(states.q, states.v, states.a)
        for constraint in held:
            left = _left(constraint, torque, wrench, center)
            shares[constraint.name].append(float((left / constraint.scale).min()))
    return Replay({name: np.array(values) for name, values in shares.items()})


def _left(constraint: object, torque: Array, wrench: Array, center: Array) -> Array:
    """Margins (T, m), written out from what MuJoCo says."""
    if isinstance(constraint, JointTorque):
        return constraint._limits - constraint._signs * torque[:, constraint._joints]
    if isinstance(constraint, Balance):
        return constraint.offsets - center[:, :2] @ constraint.normals.T
    force, moment = wrench[:, :3], wrench[:, 3:]
    if isinstance(constraint, ZeroMomentPoint):
        moment = moment - np.cross([0.0, 0.0, constraint.height], force)
        point = np.column_stack([-moment[:, 1], moment[:, 0]]) / force[:, 2:]
        return constraint.support.offsets - point @ constraint.support.normals.T
    assert isinstance(constraint, Contact)
    return wrench @ constraint.functionals.T - constraint.least_values


def run(name: str, sets: int, iterations: int) -> None:
    plain = build_problem(spec_of(name, iterations, False), CONFIGS)
    robust = build_problem(spec_of(name, iterations, True), CONFIGS)
    moved = {kind: motion_of(of) for kind, of in (("plain", plain), ("robust", robust))}
    rng = np.random.default_rng(1)
    times = np.arange(0.0, plain.trajectory.duration, 0.01)
    basis = robust.trajectory.basis(times)
    played = [robust.states(coefficients, basis) for coefficients, _ in moved.values()]
    real = consistent_robots(robust, sets, rng)
    some = max(sets // 16, 4)
    robots = np.vstack([real, *(corners(robust, states, some, rng) for states in played)])
    groups = {"consistent": slice(0, sets), "corners": slice(sets, None)}
    print(f"{name}: robots that break a limit, {sets} consistent and {len(robots) - sets} corners")
    print(f"  {'limit':14}{'robots':12}{'plain':>8}{'robust':>8}   least left, share of the limit")
    replays = {kind: replayed(robust, moved[kind][0], robots) for kind in moved}
    for limit in replays["plain"].shares:
        for group, of in groups.items():
            counts = [replays[kind].broken(limit, of) for kind in ("plain", "robust")]
            least = [replays[kind].shares[limit][of].min() for kind in ("plain", "robust")]
            print(
                f"  {limit:14}{group:12}{counts[0]:8}{counts[1]:8}   "
                f"{least[0]:8.4f} → {least[1]:8.4f}",
                flush=True,
            )
    print(
        f"  condition number: plain {moved['plain'][1]:.2f}, robust in the box "
        f"{moved['robust'][1]:.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("configs", nargs="*", default=tuple(SETTINGS))
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--iterations", type=int, default=150)
    arguments = parser.parse_args()
    for name in arguments.configs:
        run(name, arguments.sets, arguments.iterations)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
