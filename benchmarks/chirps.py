"""Planned motions beside chirps of set points, on robots without torque sensors.

    python -m benchmarks.chirps [--robots NAME …] [--seconds-per-start S] [--seeds N …]

The usual protocol for such robots (PACE, Bjelonic et al. 2025) sends every joint a chirp of set
points, 0.1 to 10 Hz in 20 s, all joints at once. Beside it stand two planned motions of 10 s: as
`excite init` proposes them with a tracking error of up to 0.2 rad, and with accelerations that
only torques bound. Amplitudes of chirps are the largest share of the joints' ranges at which the
nominal robot keeps position, speed, torque and clearances, at the best of 20 postures. All are
played on drives that follow set points (delay 8 ms, which is not told; encoders of 3e-4 rad),
inertias are 20 % off, friction and rotors are declared. Told: errors of friction and rotors, and
standard deviations, as shares of the true values (median over joints); the delay; the error of the
torque at states of another, random motion; how far a simulator is from the robot when it plays the
set points of that motion.
"""

import argparse
import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.program import excite
from excite_cli import identify, load_problem, motions_of, plan, replay
from excite_cli.api.simulating import configured_drive
from excite_cli.constraints.joint_columns import Quantity
from excite_cli.dynamics.forward_kinematics import States
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import declared_effects
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import random_baseline
from excite_cli.identification.identify import Identification
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array
from excite_cli.scoring.records import SetPointReplay
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.planned_motion import Planned, PlannedMotion
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation, simulate

_UR = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
_UR_KP, _UR_KD = (3000, 3000, 1500, 200, 200, 60), (150, 150, 60, 6, 6, 1.5)


def _by_joint(values: Sequence[float]) -> str:
    pairs = (f"{name}_joint: {value}" for name, value in zip(_UR, values, strict=True))
    return "{" + ", ".join(pairs) + "}"


ROBOTS = {
    "go2": "{kp: 20, kd: 0.5}",
    "ur10": f"{{kp: {_by_joint(_UR_KP)}, kd: {_by_joint(_UR_KD)}}}",
    "so101": "{kp: 17.8, kd: 0.6}",  # of MuJoCo Menagerie's model
}
# Where not the simulation's own sizes, which would be those of a robot without gears.
SIZES = {"so101": {"armature": 0.028, "viscous_friction": 0.05, "coulomb_friction": 0.052}}
KINDS = ("armature", "viscous_friction", "coulomb_friction")
DELAY, ENCODER, INERTIAS_OFF, RATE = 0.008, 3e-4, 0.2, 500.0
SECONDS, FIRST, LAST = 20.0, 0.1, 10.0  # s, Hz
_MOST_TORQUE = 0.8  # of effort limits, as `excite init` has it
_SHARES = np.geomspace(0.6, 0.003, 22)  # of half a joint's range
_TRIED = 20
_HELD_OUT = "other"


@dataclass(frozen=True)
class Chirps:
    """Set points from `start` (n,), with `amplitudes` (n,) [rad] and a frequency that rises."""

    start: Array
    amplitudes: Array
    name: str = "chirps"
    periodic: bool = False
    duration: float = SECONDS

    @property
    def number(self) -> bytes:
        """What its noise is drawn from."""
        return self.amplitudes.tobytes()

    def states(self, times: Array) -> tuple[Array, Array, Array]:
        """q, v, a (T, n); standing before and after."""
        inside = np.clip(times, 0.0, SECONDS)[:, None]
        rate = (LAST - FIRST) / SECONDS
        phase = 2.0 * np.pi * (FIRST * inside + 0.5 * rate * inside**2)
        speed = 2.0 * np.pi * (FIRST + rate * inside) * (inside == times[:, None])
        q = self.start + self.amplitudes * np.sin(phase)
        v = self.amplitudes * np.cos(phase) * speed
        return q, v, -self.amplitudes * np.sin(phase) * speed**2


Moved = Planned | Chirps


def chirps(problem: Problem) -> Chirps:
    """The largest that the nominal robot may be sent, of `_TRIED` postures and directions."""
    lower, upper = problem.robot.limits.ranges()
    rng = np.random.default_rng(5)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    starts = [
        problem.robot.posture,
        *(middle + 0.5 * half * rng.uniform(-1, 1, (_TRIED - 1, len(half)))),
    ]
    signs = rng.choice([-1.0, 1.0], (_TRIED, len(half)))
    for share in _SHARES:
        for start, sign in zip(starts, signs, strict=True):
            found = Chirps(start, share * half * sign)
            if _admissible(problem, found):
                return found
    raise RuntimeError("no chirp is admissible")


def _admissible(problem: Problem, motion: Chirps) -> bool:
    """Whether set points, and what the nominal robot makes of them, keep all but accelerations."""
    sent = motion.states(np.arange(0.0, SECONDS, 0.02))[0]
    if not _clear(problem, sent, 0.0 * sent):
        return False
    (run,) = played(problem, [motion], nominal=True).dataset.runs
    drive = configured_drive(problem)
    assert drive is not None
    v = np.gradient(run.q, run.t, axis=0)
    law = np.array(drive.kp) * (run.extra["q_cmd"] - run.q) - np.array(drive.kd) * v
    if np.any(np.abs(law) > _MOST_TORQUE * problem.robot.limits.effort):
        return False
    return _clear(problem, run.q[::5], v[::5])


def _clear(problem: Problem, q: Array, v: Array) -> bool:
    """Whether positions and speeds (T, n) keep what is about them."""
    beyond = (Quantity.ACCELERATION, Quantity.JERK)
    for each in problem.constraints:
        joints = each.of_joints
        if each.of_forces or (joints is not None and joints.quantity in beyond):
            continue
        if np.any(each.margins(States(problem.kinematics, q, v, 0.0 * v)) < 0.0):
            return False
    return True


def played(
    problem: Problem, motions: Sequence[Moved], seed: int = 1, nominal: bool = False
) -> Simulation:
    """What the robot makes of set points, without lead."""
    drive = configured_drive(problem)
    assert drive is not None
    settings = SimulationSettings(
        seed=seed, rate=RATE, encoder=ENCODER, inertia_error=0.0 if nominal else INERTIAS_OFF,
        drive=replace(drive, delay=DELAY),
    )  # fmt: skip
    effects = declared_effects(problem.spec.effects, problem.robot)
    sizes = SIZES.get(problem.robot.name.removesuffix(".urdf"))
    planted = [PlantedEffect(e, np.array([sizes[e.kind]])) for e in effects] if sizes else []
    made = cast(Sequence[Planned], motions)
    return simulate(problem.robot, made, settings, planted, () if sizes else effects)


def torque(problem: Problem, phi: Array, effects: Sequence[tuple[Effect, Array]], q: Array,
           v: Array, a: Array) -> Array:  # fmt: skip
    """τ (T, n) of a model at states (T, n)."""
    body, t = RigidBody(problem.robot, phi, q, v, a), np.arange(len(q)) / RATE
    signals = Signals(t, q, v, a, body.load, body.load, body, RunId("x"), 0.0, {})
    extra = [effect.torque(signals, values) for effect, values in effects]
    return np.asarray(body.load + np.sum(extra, axis=0))


def motions_for(problem: Problem) -> tuple[list[Planned], PlannedMotion]:
    """Two planned ones, and another, random one."""
    result = plan(problem, tell=lambda note: None)
    made: list[Planned] = [
        PlannedMotion(each.name, each.trajectory, each.coefficients) for each in motions_of(result)
    ]
    random = random_baseline(problem, 1, 11, 4, 0.0, lambda drawn, best: None).motions[0]
    return made, PlannedMotion(_HELD_OUT, problem.trajectory, random.coefficients)


def figures(problem: Problem, training: Sequence[Moved], other: PlannedMotion,
            seed: int, folder: Path) -> str:  # fmt: skip
    """The row of one way to excite the robot."""
    made = played(problem, [*training, other], seed)
    data = made.dataset
    found = identify(problem, data, _HELD_OUT, output=folder / "fit.h5", overwrite=True,
                     tell=lambda note: None)  # fmt: skip
    truth = {(each.effect.kind, each.effect.joints): each.values for each in made.truth.effects}
    words = []
    for kind in KINDS:
        rows = list(_shares(found, truth, kind))
        off, std = np.median(np.array(rows), axis=0)
        words.append(f"{100 * off:6.1f} ± {100 * std:5.1f}")
    assert found.spec is not None
    delay = 1e3 * (found.spec.measurement.command.delay or 0.0)
    times = np.linspace(0.0, other.duration, 400)
    states = other.states(times)
    true = torque(problem, made.truth.phi, [(e.effect, e.values) for e in made.truth.effects],
                  *states)  # fmt: skip
    own = [(effect, found.fit.effect_values(k)) for k, effect in enumerate(found.fit.effects)]
    missed = torque(problem, found.fit.phi, own, *states) - true
    share = np.sqrt(np.mean(missed**2, axis=0) / np.mean(true**2, axis=0))
    again = cast(SetPointReplay, replay(folder / "fit.h5", data, held_out=True))
    whole = [1e3 * np.mean(list(each.whole.values())) for each in again.models]
    return (
        "  ".join(words) + f"  {delay:6.2f}  {100 * share.mean():6.2f} {100 * share.max():6.2f}"
        f"  {whole[0]:6.2f} {whole[-1]:6.2f}"
    )


def _shares(
    found: Identification, truth: dict[tuple[str, tuple[int, ...]], Array], kind: str
) -> Iterator[tuple[float, float]]:
    """Error and standard deviation of every joint's first parameter, over the true value."""
    at = found.fit.rank
    for k, effect in enumerate(found.fit.effects):
        values = found.fit.effect_values(k)
        if effect.kind == kind:
            true = float(truth[kind, effect.joints][0])
            yield abs(float(values[0]) - true) / true, float(found.fit.std[at]) / true
        at += len(values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), choices=list(ROBOTS))
    parser.add_argument("--seconds-per-start", type=float, default=20.0)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    arguments = parser.parse_args()
    names = [f"{kind:>14}" for kind in KINDS]
    print(f"{'robot':6} {'motions':12} {'seed':>4} {'  '.join(names)}   delay  torque mean, max   "
          "replay URDF, model [mrad]   (errors ± deviations in %, delay in ms)")  # fmt: skip
    for robot in arguments.robots:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            config = folder / f"{robot}.yaml"
            excite("init", "--robot", robot, "-o", config)
            common = [
                f"measurement={{torque: command, command: {ROBOTS[robot]}}}",
                f"effects=[{', '.join(f'{{kind: {kind}}}' for kind in KINDS)}]",
                "constraints.tracking_error=0.2", "sequence.motions=2",
                f"optimizer.max_seconds={arguments.seconds_per_start}",
            ]  # fmt: skip
            slow = load_problem(config, common, lambda note: None)
            fast = load_problem(
                config, [*common, "constraints.joint_limits.acceleration=60"], lambda note: None
            )
            planned, other = motions_for(slow)
            quick, _ = motions_for(fast)
            swept = chirps(slow)
            share = np.abs(swept.amplitudes) / (
                0.5 * np.subtract(*slow.robot.limits.ranges()[::-1])
            )
            print(f"{robot}: chirps of {share[0]:.3f} of half the ranges", flush=True)
            ways: dict[str, Sequence[Moved]] = {
                "chirps": [swept], "planned": planned, "planned fast": quick,
            }  # fmt: skip
            for seed in arguments.seeds:
                for name, motions in ways.items():
                    row = figures(slow, motions, other, seed, folder)
                    print(f"{robot:6} {name:12} {seed:4} {row}", flush=True)


if __name__ == "__main__":
    main()
