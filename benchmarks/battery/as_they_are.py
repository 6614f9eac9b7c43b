"""Cases: a geared arm, the recordings that somebody made of it, and what is in them.

Decided before anything was run: robots of public URDFs, their inertias 30 % off; gears whose
friction is half to twice the inertial torque; one to four recordings of 8 to 30 s at 10 to 500 Hz,
of Fourier series, of moves between poses, of one sine per joint, some joints creeping; encoder
steps, noise with a memory, held samples, late torques, offsets. A fifth is clean: viscous and
Coulomb friction, offset and armature. The others have friction curves that are not in the
catalogue (`friction`), and two fifths of these a single large effect more, or several small ones
on all joints. A case follows from (seed, index) alone.

LuGre (Canudas de Wit et al. 1995): ż = v − σ₀ |v| z / g(v), F = σ₀ z + σ₁ ż, with
g(v) = F_c + (F_s − F_c) exp(−(v / v_s)²). GMS (Al-Bender et al. 2005), without its slow drift in
slip: four Maxwell elements of stiffness k and least force α g(v). Both plus a viscous curve
F_v |v|^p sign(v) of its own in each direction.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.battery import scoring
from benchmarks.battery.cases import Case
from benchmarks.battery.motions import Arm
from excite_cli.api.loading import load_case
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.build import true_inertias
from excite_cli.simulation.mujoco_model import Plant, build_plant, load_mujoco
from excite_cli.simulation.settings import SimulationSettings

_ELEMENTS = 4


@dataclass(frozen=True)
class Curve:
    """Friction of n joints, each (n,): N·m, rad, rad/s.

    `bristle`: how far [rad] a joint moves before it slips. `backward`: what all is multiplied by
    where the speed is negative. `rough` has no memory at all where it is 0.
    """

    coulomb: Array
    breakaway: Array
    stribeck: Array
    viscous: Array
    power: Array
    bristle: Array
    backward: Array
    by_load: Array
    memory: str

    def torque(self, t: Array, v: Array, load: Array, warmth: Array) -> Array:
        """Friction (T, n) along speeds v (T, n) at equal steps; `warmth` (T,) scales the viscous.

        `load` (T, n): torque that the gear carries.
        """
        height = self.coulomb + (self.breakaway - self.coulomb) * np.exp(
            -np.square(v / self.stribeck)
        )
        height = (height + self.by_load * np.abs(load)) * np.where(v < 0, self.backward, 1.0)
        slipping = self.viscous * np.abs(v) ** self.power * np.sign(v)
        slipping = slipping * warmth[:, None] * np.where(v < 0, self.backward, 1.0)
        if self.memory == "none":
            return np.asarray(slipping + height * np.tanh(v / (0.02 * self.stribeck + 1e-6)))
        step = float(t[1] - t[0])
        if self.memory == "lugre":
            return np.asarray(slipping + self._lugre(step, v, height))
        return np.asarray(slipping + self._maxwell(step, v, height))

    def _lugre(self, step: float, v: Array, height: Array) -> Array:
        stiffness = self.coulomb / self.bristle
        z, found = np.zeros(v.shape[1]), np.empty_like(v)
        damping = 0.02 * np.sqrt(stiffness)
        rate = stiffness * np.abs(v) / height
        decay = np.exp(-rate * step)
        slip = np.where(rate * step > 1e-9, -np.expm1(-rate * step) / (rate + 1e-300), step)
        for k in range(len(v)):
            new = decay[k] * z + slip[k] * v[k]
            found[k] = stiffness * new + damping * (new - z) / step
            z = new
        return found

    def _maxwell(self, step: float, v: Array, height: Array) -> Array:
        shares = np.arange(1, _ELEMENTS + 1)
        shares = shares / shares.sum()
        stiffness = self.coulomb / self.bristle / _ELEMENTS
        force, found = np.zeros((_ELEMENTS, v.shape[1])), np.empty_like(v)
        for k in range(len(v)):
            most = shares[:, None] * height[k]
            force = np.clip(force + stiffness * v[k] * step, -most, most)
            found[k] = force.sum(axis=0)
        return found


DATA = Path(__file__).parents[2] / "data"
ROBOTS = (
    "example-robot-data:ur3", "example-robot-data:ur5", "example-robot-data:ur10",
    "example-robot-data:xarm7", "example-robot-data:z1", "example-robot-data:kinova",
    "ur10_cb/ur10.urdf", "kr300/kr300.urdf", "tx40/tx40_mdh_modified.urdf", "med7/med7.urdf",
)  # fmt: skip
INERTIA_ERROR = 0.3
_STEP = 1e-3  # s, of the simulated motion
_RATES = (10, 25, 50, 100, 125, 250, 500)
_RATE_SHARES = (0.05, 0.10, 0.15, 0.20, 0.20, 0.15, 0.15)
_MOTIONS = ("series", "poses", "sines", "creeping")


def make_case(seed: int, index: int) -> Case:
    """The case of a seed and an index."""
    rng = np.random.default_rng([seed, 46, index])
    name = str(rng.choice(ROBOTS))
    where = name if ":" in name else str(DATA / name)
    given = load_case({"robot": {"urdf": where}})
    robot = given.robot
    plant = build_plant(robot, true_inertias(robot, INERTIA_ERROR, int(rng.integers(2**31))))
    clean = rng.uniform() < 0.2
    count = int(rng.choice((1, 2, 3, 4), p=(0.25, 0.25, 0.3, 0.2)))
    rate = int(rng.choice(_RATES, p=_RATE_SHARES))
    weak = rng.uniform() < 0.4  # one kind of plain motion, slow
    style = str(rng.choice(_MOTIONS))
    runs = []
    for _ in range(count):
        seconds = rng.uniform(8.0, 30.0)
        each = style if weak else str(rng.choice(("series", "series", "poses")))
        pace = rng.uniform(0.15, 0.4) if weak else rng.uniform(0.3, 0.9)
        runs.append(_motion(robot, each, seconds, pace, rng))
    loads = [_inverse(plant, *run[1:]) for run in runs]
    still = [_inverse(plant, run[1], 0 * run[2], 0 * run[3]) for run in runs]
    made = _Made(robot, plant, runs, loads, still, rng)
    torques, planted = (made.clean(), []) if clean else made.dirty()
    logs, late = _recorded(runs, torques, rate, rng, robot)
    planted += ["torque_delay"] * int(late)
    words = [f"{count} x {style if weak else 'lively'}", f"{rate} Hz", *made.words]
    of = Arm(name.split(":")[-1].split("/")[0], robot, given.base, given.spec)
    # What may be named on any joint, and nobody asks for.
    may = dict.fromkeys((*EVERYDAY_FRICTION, *EVERYDAY, *planted))
    plants = tuple(scoring.Plant((kind,), (), anywhere=True, required=False) for kind in may)
    return Case(
        index, "clean" if clean else made.memory, of, (), SimulationSettings(), given.spec, plants,
        "declared", data=Dataset(robot.joint_names, tuple(logs)), words=", ".join(words),
    )  # fmt: skip


class _Made:
    """What is added to the torque of the rigid bodies."""

    def __init__(
        self, robot: Robot, plant: Plant, runs: list, loads: list, still: list, rng
    ) -> None:
        self.robot, self.runs, self.loads, self.rng = robot, runs, loads, rng
        self.words: list[str] = []
        self.memory = str(rng.choice(("lugre", "maxwell", "none")))
        every = np.concatenate(loads)
        inertial = np.sqrt(np.mean((every - np.concatenate(still)) ** 2, axis=0))
        whole = np.sqrt(np.mean(every**2, axis=0))
        self.scale = np.maximum.reduce([inertial, 0.15 * whole, 0.02 * whole.max() + 0 * whole])
        self.speed = np.sqrt(np.mean(np.concatenate([run[2] for run in runs]) ** 2, axis=0))
        self.push = np.sqrt(np.mean(np.concatenate([run[3] for run in runs]) ** 2, axis=0))

    def _draw(self, low: float, high: float) -> Array:
        return np.asarray(self.rng.uniform(low, high, self.robot.n))

    def _rotors(self) -> list[Array]:
        """Armature whose torque is 0.1 to 1 times the scale."""
        inertia = self._draw(0.1, 1.0) * self.scale / np.maximum(self.push, 1e-3)
        offset = self._draw(-0.3, 0.3) * self.scale * (self.rng.uniform() < 0.5)
        return [run[3] * inertia + offset for run in self.runs]

    def _friction(self, plain: bool) -> list[Array]:
        coulomb = self._draw(0.5, 2.0) * self.scale
        one = np.ones(self.robot.n)
        slow = np.maximum(self.speed, 1e-3)
        power = one if plain else self._draw(0.5, 1.0)
        viscous = self._draw(0.3, 1.5) * self.scale / slow**power
        loaded = not plain and self.rng.uniform() < 0.3
        curve = Curve(
            coulomb,
            coulomb * (one if plain else self._draw(1.0, 1.6)),
            self._draw(0.02, 0.3) * slow,
            viscous,
            power,
            np.exp(self._draw(np.log(1e-4), np.log(2e-3))),
            one if plain or self.rng.uniform() < 0.6 else self._draw(0.75, 1.3),
            self._draw(0.02, 0.1) * loaded,
            "none" if plain else self.memory,
        )
        cold = 0.0 if plain or self.rng.uniform() < 0.75 else self.rng.uniform(0.1, 0.4)
        if loaded:
            self.words.append("by load")
        if cold:
            self.words.append("warming up")
        lasts, since, found = self.rng.uniform(20.0, 200.0), 0.0, []
        for (t, _, v, _), load in zip(self.runs, self.loads, strict=True):
            if plain:
                found.append(viscous * v + coulomb * np.sign(v))
            else:
                warmth = 1.0 + cold * np.exp(-(since + t) / lasts)
                found.append(curve.torque(t, v, load, warmth))
            since += t[-1] + 5.0
        self.loaded, self.warming = loaded, cold > 0
        return found

    def clean(self) -> list[Array]:
        """The textbook's model."""
        parts = zip(self.loads, self._rotors(), self._friction(plain=True), strict=True)
        return [sum(each) for each in parts]

    def dirty(self) -> tuple[list[Array], list[str]]:
        """Friction of another form and, in two fifths each, one or several effects more."""
        parts = zip(self.loads, self._rotors(), self._friction(plain=False), strict=True)
        torques = [sum(each) for each in parts]
        planted = [
            "stribeck_friction", "nonlinear_viscous_friction", "asymmetric_friction",
            "dahl_friction", "backlash",
        ]  # fmt: skip
        planted += ["load_dependent_friction"] * int(self.loaded)
        planted += ["friction_drift", "friction_change"] * int(self.warming)
        drawn = self.rng.uniform()
        if drawn < 0.4:
            torques, more = self._one_more(torques)
            planted += more
        elif drawn < 0.8:
            torques, more = self._many_small(torques)
            planted += more
        return torques, planted

    def _one_more(self, torques: list[Array]) -> tuple[list[Array], list[str]]:
        rng, n = self.rng, self.robot.n
        j = int(rng.integers(n))
        kind = str(rng.choice(("spring", "coupled", "curve", "pull")))
        self.words.append(f"{kind} on joint {j + 1}")
        size = rng.uniform(0.5, 1.5) * self.scale[j]
        q = np.concatenate([run[1][:, j] for run in self.runs])
        spread, middle = max(float(q.std()), 1e-3), float(q.mean())
        found = [np.array(each) for each in torques]
        for one, (_, angle, v, _) in zip(found, self.runs, strict=True):
            at = (angle[:, j] - middle) / spread
            if kind == "spring":
                one[:, j] += size * at
            elif kind == "curve":  # a cable's, of no form in the catalogue
                one[:, j] += size * (np.tanh(2 * at - 1) + 0.3 * at**2)
            elif kind == "coupled" and n > 1:
                k = (j + 1) % n
                rate = v[:, j] / self.speed[j] + v[:, k] / self.speed[k]
                one[:, [j, k]] += (size * np.tanh(rate / 0.05))[:, None]
            else:  # one recording with a constant pull on the joint
                one[:, j] += size if one is found[0] else 0.0
        allowed = {
            "spring": ["spring", "cable_force"],
            "curve": ["spring", "cable_force", "ripple"],
            "coupled": ["coupled_friction"],
            "pull": ["torque_offset", "contact", "payload"],
        }
        return found, allowed[kind]

    def _many_small(self, torques: list[Array]) -> tuple[list[Array], list[str]]:
        """Gains some per cent off, ripples, a little of each on all joints."""
        self.words.append("many small")
        gain = 1.0 + self._draw(-0.05, 0.05)
        height, periods = self._draw(0.02, 0.1) * self.scale, self.rng.integers(1, 40, self.robot.n)
        found = [
            each * gain + height * np.sin(periods * run[1])
            for each, run in zip(torques, self.runs, strict=True)
        ]
        return found, ["torque_gain", "ripple", "cable_force", "spring", "position_friction"]


def _motion(
    robot: Robot, style: str, seconds: float, pace: float, rng: np.random.Generator
) -> tuple[Array, Array, Array, Array]:
    """t (T,) and q, v, a (T, n) within the limits; `pace`: share of the fastest speed."""
    n, t = robot.n, np.arange(0.0, seconds, _STEP)
    lower, upper = (np.clip(each, -2.5, 2.5) for each in robot.limits.ranges())
    middle, half = (lower + upper) / 2, 0.8 * (upper - lower) / 2
    fastest = pace * np.minimum(np.abs(robot.limits.velocity), 2.5)
    if style == "poses":
        return (t, *_between_poses(t, middle, half, fastest, rng))
    base = 2 * np.pi * rng.uniform(0.05, 0.2)
    orders = np.arange(1, 6) if style == "series" else np.array([1.0])
    q, v, a = (np.zeros((len(t), n)) for _ in range(3))
    for j in range(n):
        slow = style == "creeping" and rng.uniform() < 0.5
        own = base * (rng.uniform(0.7, 1.6) if style != "series" else 1.0)
        for k in orders:
            size, phase, w = rng.normal() / k, rng.uniform(0, 2 * np.pi), k * own
            q[:, j] += size * np.sin(w * t + phase)
            v[:, j] += size * w * np.cos(w * t + phase)
            a[:, j] -= size * w * w * np.sin(w * t + phase)
        room = half[j] / np.abs(q[:, j]).max()
        most = (0.03 if slow else fastest[j]) / np.abs(v[:, j]).max()
        scale = min(room, most)
        q[:, j], v[:, j], a[:, j] = scale * q[:, j], scale * v[:, j], scale * a[:, j]
        free = max(half[j] - np.abs(q[:, j]).max(), 0.0)  # rounding where all of it is used
        q[:, j] += middle[j] + rng.uniform(-free, free)
    return t, q, v, a


def _between_poses(
    t: Array, middle: Array, half: Array, fastest: Array, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Moves of least jerk between random poses, with pauses."""
    q, v, a = (np.zeros((len(t), len(middle))) for _ in range(3))
    pose, at = middle + half * rng.uniform(-0.8, 0.8, len(middle)), 0.0
    while at < t[-1]:
        goal = middle + half * rng.uniform(-1, 1, len(middle))
        way = goal - pose
        lasts = max(float((1.875 * np.abs(way) / fastest).max()), 0.5)
        s = np.clip((t - at) / lasts, 0.0, 1.0)[:, None]
        there = t >= at
        q[there] = (pose + way * (10 * s**3 - 15 * s**4 + 6 * s**5))[there]
        v[there] = (way * (30 * s**2 - 60 * s**3 + 30 * s**4) / lasts)[there]
        a[there] = (way * (60 * s - 180 * s**2 + 120 * s**3) / lasts**2)[there]
        pose, at = goal, at + lasts + rng.choice((0.0, rng.uniform(0.0, 0.8)))
    return q, v, a


def _inverse(plant: Plant, q: Array, v: Array, a: Array) -> Array:
    """MuJoCo's torque (T, n) along a motion."""
    mujoco, data = load_mujoco(), plant.new_data()
    found = np.empty_like(q)
    order = plant.motor
    for k in range(len(q)):
        data.qpos[order], data.qvel[order], data.qacc[order] = q[k], v[k], a[k]
        mujoco.mj_inverse(plant.model, data)
        found[k] = data.qfrc_inverse[order]
    return found


def _recorded(
    runs: list, torques: list[Array], rate: int, rng: np.random.Generator, robot: Robot
) -> tuple[list[Run], bool]:
    """As a controller logs it: steps, noise, held and late torques (then True)."""
    step = 2 * np.pi / 2 ** rng.integers(14, 21)
    noise = np.exp(rng.uniform(np.log(0.005), np.log(0.05)))
    memory = rng.choice((0.0, rng.uniform(0.5, 0.95)))
    late = rng.choice((0.0, 0.0, rng.uniform(0.0, 1.5) / rate))
    held = int(rng.choice((1, 1, 1, 1, rng.integers(2, 6)))) if rate >= 50 else 1
    size = noise * np.sqrt(np.mean(np.concatenate(torques) ** 2, axis=0))
    found = []
    for (t, q, _, _), tau in zip(runs, torques, strict=True):
        at = np.arange(0.0, t[-1], 1.0 / rate)
        read = np.column_stack([np.interp(at, t, q[:, j]) for j in range(robot.n)])
        then = np.maximum(at - late, 0.0)
        then = then[(np.arange(len(at)) // held) * held]
        torque = np.column_stack([np.interp(then, t, tau[:, j]) for j in range(robot.n)])
        white = rng.normal(size=torque.shape)
        for k in range(1, len(white)):
            white[k] = memory * white[k - 1] + np.sqrt(1 - memory**2) * white[k]
        noisy = torque + size * white
        if held > 1:
            noisy = noisy[(np.arange(len(at)) // held) * held]
        found.append(Run(f"run_{len(found) + 1}", at, np.round(read / step) * step, noisy))
    return found, held > 1 or late > 0.0
