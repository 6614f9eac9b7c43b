"""Effects put into the simulated robot, and the words that ask for them.

`kind@joint[,joint…]=value[,name:value…][;runs:name|name][;covariate:column]`, for example
`coulomb_friction@elbow_joint=4`, `stribeck_friction@j2=3,stribeck_speed:0.05` or
`payload@gripper_link=1.5;runs:motion_2`.
"""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import kind_named, require_covariate
from excite_cli.effects.placing import places_named
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.model import Array, Robot
from excite_cli.simulation.covariate_series import CovariateSeries, finite_number

FORM = "kind@joint[,joint…]=value[,name:value…][;runs:name|name][;covariate:column]"


@dataclass(frozen=True)
class PlantedEffect:
    """An effect with its linear parameters; `extra` are settings of its mechanism only."""

    effect: Effect
    values: Array
    extra: Mapping[str, float] = field(default_factory=dict)
    declared: bool = False

    def named(self) -> dict[str, float]:
        """Every number by name: linear parameters, shape, extra."""
        linear = {
            p.name: float(value)
            for p, value in zip(self.effect.parameters, self.values, strict=False)
        }
        return {**self.effect.settings, **self.extra, **self.effect.shape, **linear}

    @property
    def number(self) -> str:
        """The name of the number that its kind is known by."""
        return self.effect.known_by or self.effect.parameters[0].name

    def in_words(self, joint_names: Sequence[str]) -> str:
        """As `parse_planted` takes it."""
        numbers, joints = self.named(), ",".join(joint_names[j] for j in self.effect.joints)
        names = [name for name in allowed_names(type(self.effect)) if name in numbers]
        others = "".join(f",{name}:{numbers[name]:.6g}" for name in names)
        return f"{self.effect.kind}@{joints}={numbers[self.number]:.6g}{others}"

    def record(self, joint_names: Sequence[str], sliding: NDArray[np.bool_]) -> dict[str, Any]:
        """As plain data, for files and answers; names (n,) of the robot's joints, which slide."""
        nothing = np.zeros((len(self.values), len(self.values)))
        return {
            "kind": self.effect.kind,
            "joints": [joint_names[j] for j in self.effect.joints],
            "parameters": {
                name: {"value": value.value, "unit": value.unit}
                for name, value in self.effect.report_on(sliding, self.values, nothing).items()
            },
            "shape": dict(self.effect.shape),
            "values": [float(value) for value in self.values],
            "extra": dict(self.extra),
            "runs": list(self.effect.runs),
            "covariate": self.effect.covariate,
            "declared": self.declared,
        }


def plant(
    kind: type[Effect],
    joints: tuple[int, ...],
    value: float,
    others: Mapping[str, float] | None = None,
    runs: tuple[str, ...] = (),
    covariate: str = "",
) -> PlantedEffect:
    """One effect of `kind` on `joints`, with `value` and named `others`.

    `value` is that of the number the kind is known by, usually the first parameter.
    """
    others = dict(others or {})
    if kind.known_by:
        first = others.pop(kind.parameters[0].name, 1.0)
        value, others = first, {kind.known_by: value, **others}
    extra = {name: others.pop(name) for name in kind.settings if name in others}
    shape, values = kind.planted(value, others)
    return PlantedEffect(kind(joints, shape, runs, covariate), values, extra)


def parse_planted(
    text: str, robot: Robot, takes: Mapping[str, Sequence[str]]
) -> tuple[PlantedEffect, ...]:
    """The effects that `text` asks for; a kind local to a joint gives one for each joint named.

    `takes`: names of the runs of each motion; a motion's name stands for all its runs.

    Raises
    ------
    ConfigError
        The text has another form, or names a kind, joint, parameter or run that there is not.
    """
    where = f"--effect '{text}'"
    body, *clauses = text.split(";")
    place, equals, numbers = body.partition("=")
    kind_name, at, joints_text = place.partition("@")
    if not (at and equals and kind_name.strip() and joints_text.strip()):
        example = shlex.quote(f"coulomb_friction@{robot.joint_names[-1]}=4")
        raise ConfigError(f"{where}: not of the form {FORM}; for example {example}.")
    kind = kind_named(kind_name.strip(), where)
    value, others = _numbers(numbers, kind, where)
    runs, covariate = _clauses(clauses, takes, where)
    require_covariate(kind, covariate, where)
    names = [name.strip() for name in joints_text.split(",")]
    places = places_named(kind, names, robot, where)
    return tuple(plant(kind, joints, value, others, runs, covariate) for joints in places)


def _numbers(text: str, kind: type[Effect], where: str) -> tuple[float, dict[str, float]]:
    first, *rest = text.split(",")
    value = finite_number(first, where)
    others: dict[str, float] = {}
    allowed = allowed_names(kind)
    for part in rest:
        name, colon, number = (word.strip() for word in part.partition(":"))
        if not colon:
            raise ConfigError(f"{where}: '{part}' is not name:value.")
        if name not in allowed and not _understood(kind, value, name):
            raise ConfigError(
                f"{where}: {kind.kind} has no parameter '{name}'.{nearest(name, allowed)} "
                f"Allowed after the first value: {', '.join(allowed) or 'none'}."
            )
        others[name] = finite_number(number, where)
    return value, others


def allowed_names(kind: type[Effect]) -> tuple[str, ...]:
    """Names of what may be given besides the first parameter."""
    every = (*(p.name for p in kind.parameters), *(p.name for p in kind.shapes))
    known_by = kind.known_by or kind.parameters[0].name
    own = tuple(name for name in every if name != known_by)
    return (*own, *kind.settings)


def _understood(kind: type[Effect], value: float, name: str) -> bool:
    """Whether `kind` takes `name` when planted: some say their parameters in other words too."""
    first, second = (kind.planted(value, {name: probe}) for probe in (0.37, 0.73))
    return first[0] != second[0] or not np.array_equal(first[1], second[1])


def _clauses(
    clauses: Sequence[str], takes: Mapping[str, Sequence[str]], where: str
) -> tuple[tuple[str, ...], str]:
    """The runs and the column of the log that are named after `;`."""
    runs: tuple[str, ...] = ()
    covariate = ""
    for clause in clauses:
        word, colon, names = (part.strip() for part in clause.partition(":"))
        if word not in ("runs", "covariate") or not colon or not names:
            raise ConfigError(
                f"{where}: after ';' only 'runs:name|name' and 'covariate:column' are allowed."
            )
        if word == "covariate":
            covariate = names
        else:
            runs += _runs(names, takes, where)
    return tuple(dict.fromkeys(runs)), covariate


def _runs(names: str, takes: Mapping[str, Sequence[str]], where: str) -> tuple[str, ...]:
    runs = [run for each in takes.values() for run in each]
    known = {**{run: (run,) for run in runs}, **takes}
    chosen: list[str] = []
    for name in (part.strip() for part in names.split("|")):
        if name not in known:
            raise ConfigError(
                f"{where}: there is no run '{name}'.{nearest(name, runs)} Runs: {', '.join(runs)}."
            )
        chosen += known[name]
    return tuple(chosen)


# Plausible sizes for the effects that the configuration declares: the robot has them too.

_SHARE = (0.03, 0.10)  # of the joint's torque RMS, per parameter
_SAMPLES, _STATES = 200, 7  # random states, and their seed
_LEAST = 1e-3  # of the largest joint's torque RMS


def sized(
    robot: Robot,
    effects: Sequence[Effect],
    seed: int,
    covariates: Sequence[CovariateSeries] = (),
) -> tuple[PlantedEffect, ...]:
    """Each effect with values that give 3–10 % of the joint's torque RMS on brisk random states.

    They depend on the robot and the seed alone: the same robot plays every motion.

    Kinds that act on the whole robot, and defects of the data, take a twentieth of the upper end
    of their usual range. `covariates` are the columns of the log that effects follow.
    """
    if not effects:
        return ()
    rng = np.random.default_rng([seed, 1])
    followed = {
        each.name: np.interp(np.linspace(0, 1, _SAMPLES), np.linspace(0, 1, len(each.values)),
                             each.values)
        for each in covariates
    }  # fmt: skip
    signals = replace(_signals(robot), covariates=followed)
    load = np.sqrt(np.mean(signals.load**2, axis=0))
    load = np.maximum(load, _LEAST * load.max() + 1e-9)
    planted = []
    for effect in effects:
        share = rng.uniform(*_SHARE, len(effect.parameters))
        sign = np.where(
            [p.nonnegative for p in effect.parameters],
            1.0,
            rng.choice([-1.0, 1.0], len(effect.parameters)),
        )
        if effect.data_defect or effect.scope == "robot":
            shape, values = type(effect).planted(effect.parameters[0].high / 20, effect.shape)
            effect = replace(effect, shape=shape)
        else:
            unit = _per_unit(effect, signals)
            size = share * load[list(effect.joints)].min() / np.maximum(unit, 1e-6)
            values = sign * np.minimum(size, [p.high for p in effect.parameters])
        planted.append(PlantedEffect(effect, values, declared=True))
    return tuple(planted)


def _per_unit(effect: Effect, signals: Signals) -> Array:
    """RMS of each column over all rows the effect touches (P,)."""
    return np.asarray(np.sqrt(np.mean(effect.columns(signals) ** 2, axis=(0, 1))))


def _signals(robot: Robot) -> Signals:
    q, v, a = robot.draw_states(_SAMPLES, _STATES)
    v, a = 0.5 * v, 0.3 * a
    t = np.linspace(0.0, 1.0, _SAMPLES)
    body = RigidBody(robot, standard_parameters(robot), q, v, a)
    return Signals(t, q, v, a, body.load, body.load, body)
