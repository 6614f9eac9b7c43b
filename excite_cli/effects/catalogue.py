"""All effects by their kind, and those that a config or a description declares."""

from collections.abc import Collection, Mapping

import numpy as np

from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.base import Effect
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.payload import Payload
from excite_cli.effects.placing import ALL, places_named
from excite_cli.effects.torque_gain import TorqueGain
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.effects.wrench_gain import WrenchGain
from excite_cli.errors import ConfigError, nearest
from excite_cli.registry import Registry
from excite_cli.robot.model import Array, Robot

# What every textbook's model of a joint has beside the rigid body; the rest of it where data ask.
EVERYDAY_FRICTION = ("viscous_friction", "coulomb_friction")
EVERYDAY = ("torque_offset", "armature")


def _flaw(kind: type[Effect], kinds: Collection[str]) -> str:
    """What `kind` says of kinds that there are not; empty if it says nothing of such."""
    for trait in ("refines", "excludes", "same_as", "deviates_from", "changes_of"):
        for name in getattr(kind, trait):
            if name not in kinds:
                return f"`{trait}` names '{name}', which does not exist.{nearest(name, kinds)}"
    return ""


EFFECTS: Registry[Effect] = Registry(
    "effect",
    "excite.effects",
    Effect,
    {
        "viscous_friction": "viscous_friction:ViscousFriction",
        "nonlinear_viscous_friction": "nonlinear_viscous_friction:NonlinearViscousFriction",
        "coulomb_friction": "coulomb_friction:CoulombFriction",
        "asymmetric_friction": "asymmetric_friction:AsymmetricFriction",
        "stribeck_friction": "stribeck_friction:StribeckFriction",
        "load_dependent_friction": "load_dependent_friction:LoadDependentFriction",
        "gear_loss": "gear_loss:GearLoss",
        "position_friction": "position_friction:PositionFriction",
        "dahl_friction": "dahl_friction:DahlFriction",
        "friction_drift": "friction_drift:FrictionDrift",
        "friction_change": "friction_change:FrictionChange",
        "covariate_friction": "covariate_friction:CovariateFriction",
        "coupled_friction": "coupled_friction:CoupledFriction",
        "armature": "armature:Armature",
        "coupled_armature": "coupled_armature:CoupledArmature",
        "spring": "spring:Spring",
        "torque_offset": "torque_offset:TorqueOffset",
        "covariate_offset": "covariate_offset:CovariateOffset",
        "torque_gain": "torque_gain:TorqueGain",
        "torque_crosstalk": "torque_crosstalk:TorqueCrosstalk",
        "torque_delay": "torque_delay:TorqueDelay",
        "wrench_gain": "wrench_gain:WrenchGain",
        "torque_saturation": "torque_saturation:TorqueSaturation",
        "ripple": "ripple:Ripple",
        "cable_force": "cable_force:CableForce",
        "elasticity": "elasticity:Elasticity",
        "backlash": "backlash:Backlash",
        "base_tilt": "base_tilt:BaseTilt",
        "payload": "payload:Payload",
        "encoder_offset": "encoder_offset:EncoderOffset",
        "contact": "contact:Contact",
    },
    ("kind", "title", "parameters"),
    _flaw,
)


def catalogue() -> Mapping[str, type[Effect]]:
    """All kinds by name."""
    return EFFECTS.members


def kind_named(name: str, where: str = "effects") -> type[Effect]:
    """The class of a kind; ConfigError if there is none of this name."""
    return EFFECTS.named(name, where)


def declared_effects(specs: tuple[EffectSpec, ...] | None, robot: Robot) -> tuple[Effect, ...]:
    """Effects of the declared model; without `specs`, the friction of the URDF's <dynamics>.

    Those that show in no measured row are none of it.

    Raises
    ------
    ConfigError
        A kind, joint or shape is unknown, or the joints do not fit the kind.
    """
    if specs is None:
        found = urdf_friction(robot)[0]
    else:
        found = tuple(effect for i, spec in enumerate(specs) for effect in _built(spec, i, robot))
    return tuple(effect for effect in found if shows(effect, robot))


def shows(effect: Effect, robot: Robot) -> bool:
    """Whether some row in which `effect` shows is measured."""
    rows = effect.rows(robot.n)
    return not {robot.joint_names[j] for j in rows} <= set(robot.unmeasured)


def urdf_friction(robot: Robot) -> tuple[tuple[Effect, ...], Array]:
    """Effects of the URDF's <dynamics> (damping, friction), and their parameters (k,) there.

    Friction of joints that follow others is felt by their drivers, which turn 1/multiplier as fast.
    """
    tree = robot.tree
    damping, friction = (x[tree.moved] for x in (robot.model.damping, robot.model.friction))
    if robot.coupling is not None:
        shares = np.abs(robot.coupling.matrix)
        damping, friction = damping @ shares**2, friction @ shares
    damped, dry = np.flatnonzero(damping > 0), np.flatnonzero(friction > 0)
    effects = (
        *(ViscousFriction((int(j),)) for j in damped),
        *(CoulombFriction((int(j),)) for j in dry),
    )
    return effects, np.concatenate([damping[damped], friction[dry]])


def straight_friction(joint: int) -> tuple[Effect, ...]:
    """Viscous and Coulomb friction of a joint: the line over speed that data sheets give."""
    return ViscousFriction((joint,)), CoulombFriction((joint,))


def rubs(kind: type[Effect]) -> bool:
    """Whether a kind is friction: plain, or what refines or couples that."""
    plain = {each.kind for each in straight_friction(0)}
    return kind.friction or bool(plain & set(kind.refines))


def carried_body(joint: int, runs: tuple[str, ...] = ()) -> Effect:
    """A body on the link that `joint` moves, in these runs (empty: all), by its ten parameters."""
    return Payload((joint,), {}, runs)


def scales(robot: Robot) -> tuple[Effect, ...]:
    """What measured torques and the wrench at the base come in, beside what is taken for it.

    One gain for every joint, and one for all rows of a base.
    """
    base, joints = range(robot.base_joints), range(robot.base_joints, robot.n)
    every = [WrenchGain(tuple(base)), *(TorqueGain((j,)) for j in joints)]
    return tuple(effect for effect in every if effect.joints and shows(effect, robot))


def _built(spec: EffectSpec, index: int, robot: Robot) -> list[Effect]:
    where = f"effects[{index}]"
    kind = kind_named(spec.kind, f"{where}.kind")
    names = (ALL,) if spec.joints == "all" else spec.joints
    places = places_named(kind, names, robot, f"{where}.joints")
    known = {parameter.name: parameter for parameter in kind.shapes}
    for name in spec.shape:
        if name not in known:
            raise ConfigError(
                f"{where}.shape: {spec.kind} has no parameter '{name}'.{nearest(name, known)} "
                f"Allowed: {', '.join(known) or 'none'}."
            )
    require_covariate(kind, spec.covariate, f"{where}.covariate")
    shape, _ = kind.planted(0.0, spec.shape)
    runs = () if spec.runs == "all" else spec.runs
    return [kind(place, shape, runs, spec.covariate) for place in places]


def require_covariate(kind: type[Effect], covariate: str, where: str) -> None:
    """Raise ConfigError unless a column of the log is named exactly where the kind follows one."""
    if kind.follows_covariate and not covariate:
        raise ConfigError(
            f"{where}: {kind.kind} follows a column of the log. Name one of those in "
            "measurement.covariates."
        )
    if covariate and not kind.follows_covariate:
        raise ConfigError(
            f"{where}: {kind.kind} follows no column of the log; leave '{covariate}' out."
        )
