"""What the robot of one run is made of, and its making: inertias, joints, drives, instruments."""

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from excite_cli.dynamics.pseudo_inertia import pseudo_inertias, ten_parameters
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY, standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.simulated_robot import DryCoupling, Hysteresis, Push, Transmission
from excite_cli.errors import RobotError
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.covariate_series import CovariateSeries
from excite_cli.simulation.ground_truth import PlantedEffect
from excite_cli.simulation.mujoco_model import (
    Plant,
    build_plant,
    coupling_name,
    load_mujoco,
    refresh,
)

# Inertias that differ from the URDF, as those of a real robot do, and stay those of some body.
#
# Of a body with pseudo-inertia P = [[Σ, h], [hᵀ, m]] (second moments about the joint, first moment,
# mass) the true one is L P Lᵀ with L near 1. That is what moving, stretching and re-weighing the
# mass gives: if P ⪰ 0, so is L P Lᵀ.

_LEAST_MASS = 1e-9
_SHAPE_SHARE, _LEVER_SHARE = 0.5, 0.5


def true_inertias(robot: Robot, error: float, seed: int) -> Array:
    """φ (10·n_bodies,): mass off by 0.5–1.5 times `error`, shape and centre of mass likewise.

    `error` 0.2 changes the parameters by 10–30 %; 0 returns those of the URDF.
    """
    nominal = standard_parameters(robot)
    if error == 0.0:
        return nominal
    rng = np.random.default_rng([seed, 0])
    bodies = nominal.reshape(-1, PARAMETERS_PER_BODY)
    changed = [_changed(ten, error, rng) for ten in bodies]
    return np.concatenate(changed)


def _changed(ten: Array, error: float, rng: np.random.Generator) -> Array:
    """One body's parameters, perturbed; draws as many numbers for every body."""
    scale = 1.0 + rng.choice([-1.0, 1.0]) * error * rng.uniform(0.5, 1.5)
    stretch = _SHAPE_SHARE * error * rng.normal(size=(3, 3)) / np.sqrt(3)
    direction = rng.normal(size=3)
    mass = float(ten[0])
    if mass <= _LEAST_MASS:
        return np.array(ten)
    pseudo = pseudo_inertias(ten)[0]
    lever = ten[1:4] / mass
    spread = np.sqrt(max(np.trace(pseudo[:3, :3]) / mass - lever @ lever, 0.0))
    change = np.eye(4)
    change[:3, :3] += stretch
    change[:3, 3] = _LEVER_SHARE * error * spread * direction / np.linalg.norm(direction)
    return max(scale, 0.05) * ten_parameters(change @ pseudo @ change.T)


_STABLE = 0.25  # step times the highest frequency of springs
_MOST_STEPS = 200
_NOTHING = 1e-9  # kg·m²
_HARD = (0.99, 0.999, 1e-4, 0.5, 2.0)  # flanks of a gear


@dataclass
class Build:
    """One run's robot while effects are built into it; arrays are (n,) per moved joint.

    `springs` are k and c of k q + c. `looped` effects act through their own formula at every step,
    `hystereses` through the memory of a joint;
    `compensated` ones are known to the controller;
    `recorded` ones change what is written down. `reading` (n, 2): sharpness and level of the
    saturation of the recorded torque. `start`: when the run begins, on the campaign's clock [s];
    `series` of what effects may follow.
    """

    robot: Robot
    phi: Array
    run: RunId
    gravity: Array
    armature: Array
    damping: Array
    friction: Array
    springs: Array
    clip: Array
    position_offset: Array
    reading: Array
    delay: Array
    gain: Array
    offset: Array
    soft: dict[int, Transmission] = field(default_factory=dict)
    couplings: list[DryCoupling] = field(default_factory=list)
    pushes: list[Push] = field(default_factory=list)
    looped: list[PlantedEffect] = field(default_factory=list)
    hystereses: list[tuple[int, Hysteresis]] = field(default_factory=list)
    compensated: list[PlantedEffect] = field(default_factory=list)
    recorded: list[PlantedEffect] = field(default_factory=list)
    start: float = 0.0
    series: tuple[CovariateSeries, ...] = ()

    @classmethod
    def bare(cls, robot: Robot, phi: Array, run: RunId) -> "Build":
        """Rigid bodies only."""
        zeros = np.zeros((8, robot.n))
        return cls(
            robot=robot,
            phi=phi.copy(),
            run=run,
            gravity=np.array(robot.model.gravity.linear),
            armature=zeros[0],
            damping=zeros[1],
            friction=zeros[2],
            springs=np.zeros((robot.n, 2)),
            clip=np.full(robot.n, np.inf),
            position_offset=zeros[3],
            reading=np.full((robot.n, 2), [0.0, np.inf]),
            delay=zeros[4],
            gain=zeros[5],
            offset=zeros[6],
        )

    def covariates(self, t: Array) -> dict[str, Array]:
        """What effects may follow, by name, at instants `t` (T,) of the run [s]."""
        return {each.name: each.at(self.start + t) for each in self.series}

    def link_inertia(self, joint: int) -> float:
        """What `joint` turns at the reference posture with all others held [kg·m²]."""
        plant = build_plant(self.robot, self.phi)
        return float(mass_matrix(plant, self.robot.posture)[joint, joint])

    def add_to_joint(self, joint: int, parts: Mapping[str, float]) -> None:
        """Attributes of MuJoCo's joint; several springs on a joint are one."""
        self.damping[joint] += parts.get("damping", 0.0)
        self.friction[joint] += parts.get("frictionloss", 0.0)
        self.armature[joint] += parts.get("armature", 0.0)
        stiffness = parts.get("stiffness", 0.0)
        self.springs[joint] += [stiffness, -stiffness * parts.get("springref", 0.0)]

    def apply(self, effect: Effect, values: Array) -> None:
        """Through the effect's own formula, at every step."""
        self.looped.append(PlantedEffect(effect, values))

    def remember(self, joint: int, hysteresis: Hysteresis) -> None:
        """On one joint, from step to step."""
        self.hystereses.append((joint, hysteresis))

    def tell_controller(self, effect: Effect, values: Array) -> None:
        """For the controller to compensate."""
        self.compensated.append(PlantedEffect(effect, values))

    def falsify(self, effect: Effect, values: Array) -> None:
        """By the effect's own formula, what is recorded."""
        self.recorded.append(PlantedEffect(effect, values))


def assemble(
    robot: Robot,
    phi: Array,
    run: RunId,
    planted: Iterable[PlantedEffect],
    start: float = 0.0,
    series: tuple[CovariateSeries, ...] = (),
) -> Build:
    """The robot of one run with the effects that are active in it."""
    build = replace(Build.bare(robot, phi, run), start=start, series=series)
    for each in planted:
        if each.effect.active(run):
            each.effect.build_into(build, each.values, each.named())
    return build


def make(build: Build, step: float) -> Plant:
    """The compiled robot of `build`, with no step longer than `step` or than its springs allow.

    Raises
    ------
    RobotError
        A joint moves no inertia or has less than no dry friction, or its springs are too stiff to
        be simulated.
    """
    soft = sorted(build.soft)
    couplings = [(c.first, c.second, c.direction) for c in build.couplings]
    plant = build_plant(build.robot, build.phi, step, soft, couplings)
    model, motor = plant.model, plant.motor
    model.opt.gravity[:] = build.gravity
    model.dof_armature[motor] = build.armature
    for j, transmission in build.soft.items():
        gear = plant.gear[j]
        model.dof_armature[motor[j]] = build.armature[j] + transmission.rotor
        model.jnt_stiffness[gear] = transmission.stiffness
        model.dof_damping[gear] = transmission.damping
        if transmission.play > 0.0:
            model.jnt_limited[gear] = 1
            model.jnt_range[gear] = [-transmission.play / 2, transmission.play / 2]
            model.jnt_solimp[gear] = _HARD
    model.dof_damping[motor] = build.damping
    model.dof_frictionloss[motor] = build.friction
    for c, coupling in enumerate(build.couplings):
        model.tendon_frictionloss[model.tendon(coupling_name(c)).id] = coupling.force
    stiff, constant = build.springs.T
    model.jnt_stiffness[motor] = stiff
    model.qpos_spring[motor] = np.divide(
        -constant, stiff, out=np.zeros(len(stiff)), where=stiff > 0
    )
    _check_friction(build)
    _check_inertia(build, plant)
    if plant.coupled:
        _check_followers(build, plant)
    refresh(plant)
    _shorten(plant, step)
    model.jnt_solref[:] = [2 * model.opt.timestep, 1.0]
    return plant


def mass_matrix(plant: Plant, q: Array) -> Array:
    """Inertia (n, n) as the motors see it with stiff transmissions, armatures included."""
    return np.asarray(mass_matrices(plant, q[None])[0])


def mass_matrices(plant: Plant, q: Array) -> Array:
    """As `mass_matrix`, for postures (T, n)."""
    data, n = plant.new_data(), len(plant.motor)
    return np.array([_full(plant, data, posture)[:n, :n] for posture in q])


def sudden_inertias(plant: Plant, q: Array) -> Array:
    """What the motors feel of a quick push, (T, n, n): links behind soft gears do not follow."""
    data, n = plant.new_data(), len(plant.motor)
    inverse = np.linalg.inv
    return np.array([inverse(inverse(_full(plant, data, each))[:n, :n]) for each in q])


def _full(plant: Plant, data: Any, q: Array) -> Array:
    """Inertia of the coordinates that move on their own, the motors' first."""
    mujoco = load_mujoco()
    size = plant.model.nv
    data.qpos[:] = plant.coordinates(q)
    mujoco.mj_kinematics(plant.model, data)
    mujoco.mj_comPos(plant.model, data)
    if plant.model.ntendon:
        mujoco.mj_tendon(plant.model, data)
    mujoco.mj_crb(plant.model, data)
    full, unit = np.empty((size, size)), np.zeros(size)
    for column in range(size):
        unit[column] = 1.0
        mujoco.mj_mulM(plant.model, data, full[column], unit)
        unit[column] = 0.0
    return np.asarray(plant.spread.T @ full @ plant.spread)


def _check_friction(build: Build) -> None:
    """What takes the place of dry friction needs as much of it."""
    short = build.friction < -1e-9
    if short.any():
        j = int(np.argmax(short))
        name, unit = build.robot.joint_names[j], "N" if build.robot.sliding[j] else "N·m"
        raise RobotError(
            f"joint '{name}' of the simulated robot lacks {-build.friction[j]:.3g} {unit} of dry "
            "friction, of which a planted effect is a part. Plant more of it: --effect "
            f"{shlex.quote(f'coulomb_friction@{name}=…')}."
        )


def _check_followers(build: Build, plant: Plant) -> None:
    """MuJoCo knows the joints that follow others as joints of their own, which must move a mass."""
    tree = build.robot.tree
    column, unit = np.zeros(plant.model.nv), np.eye(plant.model.nv)
    data = plant.new_data()
    data.qpos[:] = plant.coordinates(build.robot.posture)
    load_mujoco().mj_forward(plant.model, data)
    for name, body in zip(tree.joint_names, plant.bodies, strict=True):
        at = int(plant.model.body_dofadr[body])
        load_mujoco().mj_mulM(plant.model, data, column, unit[at])
        if column[at] <= _NOTHING and name not in build.robot.joint_names:
            raise RobotError(
                f"joint '{name}', which follows another one, moves no inertia and cannot be "
                "simulated. Give its links an inertia in the URDF, or lock its driver."
            )


def _check_inertia(build: Build, plant: Plant) -> None:
    matrix = mass_matrix(plant, build.robot.posture)
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-12))
    worst, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    if np.diag(matrix).min() > _NOTHING and worst[0] > _NOTHING:
        return
    light = int(np.argmin(np.diag(matrix)))
    joint = light if np.diag(matrix)[light] <= _NOTHING else int(np.argmax(np.abs(vectors[:, 0])))
    raise RobotError(
        f"joint '{build.robot.joint_names[joint]}' moves no inertia and cannot be simulated. Give "
        f"its links an inertia in the URDF, lock it, or plant a motor's inertia: --effect "
        f"{shlex.quote(f'armature@{build.robot.joint_names[joint]}=0.1')}."
    )


def _shorten(plant: Plant, step: float) -> None:
    """Shorten the step until the stiffest spring is followed."""
    model = plant.model
    stiffness = np.asarray(model.jnt_stiffness).reshape(model.njnt, -1)[:, 0]
    if not stiffness.any():
        return
    full = _full(plant, plant.new_data(), np.zeros(len(plant.motor)))
    root = np.sqrt(stiffness)[plant.motor.tolist() + plant.gear[plant.gear >= 0].tolist()]
    square = np.linalg.eigvalsh(root[:, None] * np.linalg.solve(full, np.diag(root)))
    needed = step * np.sqrt(max(square[-1], 0.0)) / _STABLE
    if needed > _MOST_STEPS:
        raise RobotError(
            f"a spring of the simulated robot swings at {np.sqrt(square[-1]):.3g} rad/s, too fast "
            "to be followed. Take a softer one, or more inertia at its ends."
        )
    model.opt.timestep = step / max(1, int(np.ceil(needed)))
    model.dof_solref[:, 0] = 2 * model.opt.timestep
    model.eq_solref[:, 0] = 2 * model.opt.timestep
    if model.ntendon:
        model.tendon_solref_fri[:, 0] = 2 * model.opt.timestep
