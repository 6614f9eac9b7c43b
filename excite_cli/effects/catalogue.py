"""The catalogue: every kind of effect by its name; users' own come through an entry point.

A package that declares, in the group `excite.effects`, a name for a subclass of `Effect` adds it.
"""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points

from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.armature import Armature
from excite_cli.effects.asymmetric_friction import AsymmetricFriction
from excite_cli.effects.backlash import Backlash
from excite_cli.effects.base import Effect
from excite_cli.effects.base_tilt import BaseTilt
from excite_cli.effects.cable_force import CableForce
from excite_cli.effects.contact import Contact
from excite_cli.effects.coulomb_friction import CoulombFriction
from excite_cli.effects.coupled_friction import CoupledFriction
from excite_cli.effects.elasticity import Elasticity
from excite_cli.effects.encoder_offset import EncoderOffset
from excite_cli.effects.friction_drift import FrictionDrift
from excite_cli.effects.load_dependent_friction import LoadDependentFriction
from excite_cli.effects.nonlinear_viscous_friction import NonlinearViscousFriction
from excite_cli.effects.payload import Payload
from excite_cli.effects.ripple import Ripple
from excite_cli.effects.spring import Spring
from excite_cli.effects.stribeck_friction import StribeckFriction
from excite_cli.effects.torque_delay import TorqueDelay
from excite_cli.effects.torque_gain import TorqueGain
from excite_cli.effects.torque_offset import TorqueOffset
from excite_cli.effects.torque_saturation import TorqueSaturation
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.errors import ConfigError, nearest
from excite_cli.robot.model import Robot

GROUP = "excite.effects"
_OURS: tuple[type[Effect], ...] = (
    ViscousFriction,
    NonlinearViscousFriction,
    CoulombFriction,
    AsymmetricFriction,
    StribeckFriction,
    LoadDependentFriction,
    FrictionDrift,
    CoupledFriction,
    Armature,
    Spring,
    TorqueOffset,
    TorqueGain,
    TorqueDelay,
    TorqueSaturation,
    Ripple,
    CableForce,
    Elasticity,
    Backlash,
    BaseTilt,
    Payload,
    EncoderOffset,
    Contact,
)


@cache
def catalogue() -> Mapping[str, type[Effect]]:
    """All kinds by name.

    Raises
    ------
    ConfigError
        An effect of a package cannot be loaded, is none, takes a name that exists, or states
        something about a kind that does not.
    """
    kinds = {effect.kind: effect for effect in _OURS}
    for point in entry_points(group=GROUP):
        try:
            found = point.load()
        except Exception as error:
            raise ConfigError(
                f"effect '{point.name}' ({point.value}) cannot be loaded: {error}."
            ) from error
        if not (isinstance(found, type) and issubclass(found, Effect)):
            raise ConfigError(f"effect '{point.name}' ({point.value}) is not a subclass of Effect.")
        if found.kind in kinds:
            raise ConfigError(f"effect '{found.kind}' ({point.value}): there is one of this name.")
        kinds[found.kind] = found
    for kind in kinds.values():
        _require_known(kind, kinds)
    return kinds


def _require_known(kind: type[Effect], kinds: Mapping[str, type[Effect]]) -> None:
    """Raise ConfigError if a trait of `kind` names a kind that there is not."""
    for trait in ("refines", "excludes", "same_as", "deviates_from"):
        for name in getattr(kind, trait):
            if name not in kinds:
                raise ConfigError(
                    f"effect '{kind.kind}': {trait} names '{name}', which there is not."
                    f"{nearest(name, kinds)} Effects: {', '.join(kinds)}."
                )


def kind_named(name: str, where: str = "effects") -> type[Effect]:
    """The class of a kind.

    Raises
    ------
    ConfigError
        There is none of this name.
    """
    kinds = catalogue()
    if name not in kinds:
        raise ConfigError(
            f"{where}: there is no effect '{name}'.{nearest(name, kinds)} "
            f"Effects: {', '.join(kinds)}."
        )
    return kinds[name]


def declared_effects(specs: tuple[EffectSpec, ...] | None, robot: Robot) -> tuple[Effect, ...]:
    """Effects of the declared model; without `specs`, the friction of the URDF's <dynamics>.

    Raises
    ------
    ConfigError
        A kind, joint or shape is unknown, or the joints do not fit the kind.
    """
    if specs is None:
        model, moved = robot.model, robot.moved
        damped = [j for j in range(robot.n) if model.damping[moved[j]] > 0]
        dry = [j for j in range(robot.n) if model.friction[moved[j]] > 0]
        return (
            *(ViscousFriction((j,)) for j in damped),
            *(CoulombFriction((j,)) for j in dry),
        )
    return tuple(effect for i, spec in enumerate(specs) for effect in _built(spec, i, robot))


def _built(spec: EffectSpec, index: int, robot: Robot) -> list[Effect]:
    where = f"effects[{index}]"
    kind = kind_named(spec.kind, f"{where}.kind")
    names = list(robot.joint_names)
    if spec.joints == "all":
        places = [tuple(range(robot.n))] if kind.scope == "robot" else kind.places(robot)
    else:
        for joint in spec.joints:
            if joint not in names:
                raise ConfigError(
                    f"{where}.joints: no moved joint '{joint}'.{nearest(joint, names)} "
                    f"Moved joints: {', '.join(names)}."
                )
        chosen = tuple(names.index(joint) for joint in spec.joints)
        if kind.scope == "pair" and len(chosen) != 2:
            raise ConfigError(f"{where}.joints: {spec.kind} acts on two joints; name exactly two.")
        places = [(j,) for j in chosen] if kind.scope == "joint" else [chosen]
    known = {parameter.name: parameter for parameter in kind.shapes}
    for name in spec.shape:
        if name not in known:
            raise ConfigError(
                f"{where}.shape: {spec.kind} has no parameter '{name}'.{nearest(name, known)} "
                f"Allowed: {', '.join(known) or 'none'}."
            )
    shape, _ = kind.planted(0.0, spec.shape)
    runs = () if spec.runs == "all" else spec.runs
    return [kind(place, shape, runs) for place in places]
