"""What is known of the torque's scale: how well the drives' gains are, and what was weighed.

    τ_measured,j = (1 + g_j) τ_j,    g ~ N(0, s² (1 + 1 1ᵀ))

Without anything that somebody weighed, one gain of all joints is a scale of all inertias, friction
and other loads: g is as uncertain as it is said to be, the joints' gains together as much as each
beside the others, and so is everything that is found. What was weighed is a payload on some runs,
or the whole robot where the wrench at its base is measured. A known payload's mass, centre and
inertia are independent; what they make of its ten parameters is taken to first order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lstsq

from excite_cli.config.data_spec import (
    IdentificationSpec,
    KnownPayloadSpec,
    MeasurementSpec,
)
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.pseudo_inertia import moved
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import carried_body, scales
from excite_cli.effects.judgement import half_of
from excite_cli.errors import ConfigError
from excite_cli.identification.link_changes import SIX_AT, about_frame, slopes
from excite_cli.identification.regression import places_of, width_of
from excite_cli.measurement.dataset import Finding
from excite_cli.measurement.torque_sources.catalogue import torque_source
from excite_cli.robot.link_frame import link_frame, own_link
from excite_cli.robot.model import Array, Robot

# Keys of what was weighed, as messages tell them.
KNOWN_LOAD, KNOWN_MASS = "identification.known_payload", "identification.total_mass"
# Of gains that a known payload is to tell: more is another unit.
_ANY_GAIN = 0.3
# Of a body that nobody described: radius of a sphere of its mass, and how wrong that may be [m].
_RADIUS = 0.05
_LEAST = 1e-4  # of the mass, and m: what was weighed and measured is no truer
_NO_TORQUE = -0.9  # gain: a tenth of the torque is left, which no constant is wrong by
_VISIBLE = 1e-6  # of a mass: what is more than rounding belongs to a mass that does not show


@dataclass(frozen=True)
class Knowledge:
    """Effects (the declared ones first), and what is known: ‖rows θ − target‖².

    In units of standard deviations; rows (m, r + k) over the base parameters and all linear
    parameters of the effects.
    """

    effects: tuple[Effect, ...]
    rows: Array
    target: Array


def knowledge_of(
    spec: IdentificationSpec, declared: Sequence[Effect], robot: Robot, base: BaseParameters
) -> Knowledge:
    """As `weighed`, with gains beside, if anything tells them, and how uncertain they are."""
    known = weighed(spec, declared, robot, base)
    if not len(known.target) and spec.gain_std is None:
        return known
    gains = scales(robot)
    deviation = _ANY_GAIN if spec.gain_std is None else spec.gain_std
    spread = deviation**2 * (np.eye(len(gains)) + 1.0)
    return _with(known, gains, np.zeros(len(gains)), spread)


def weighed(
    spec: IdentificationSpec, declared: Sequence[Effect], robot: Robot, base: BaseParameters
) -> Knowledge:
    """The declared effects, a known payload beside them, and what scales said of it and the robot.

    Raises
    ------
    ConfigError
        The payload's link is unknown, or nothing moves it; no body has its inertia; the robot's
        whole mass does not show.
    """
    width = base.rank + width_of(declared)
    known = Knowledge(tuple(declared), np.zeros((0, width)), np.zeros(0))
    if spec.total_mass is not None:
        mass, std = spec.total_mass.mass, max(spec.total_mass.std, _LEAST * spec.total_mass.mass)
        row = np.zeros((1, width))
        row[0, : base.rank] = total_mass_row(robot, base) / std
        known = Knowledge(known.effects, row, np.array([mass / std]))
    if spec.known_payload is not None:
        body, mean, covariance = known_body(spec.known_payload, robot)
        known = _with(known, [body], mean, covariance)
    return known


def _with(known: Knowledge, more: Sequence[Effect], mean: Array, covariance: Array) -> Knowledge:
    """And `more` effects, unless declared, whose parameters are N(mean, covariance)."""
    new = [effect for effect in more if effect not in known.effects]
    effects = (*known.effects, *new)
    rows = np.pad(known.rows, ((0, 0), (0, width_of(new))))
    places = places_of(effects, rows.shape[1])
    whiten = np.linalg.inv(half_of(covariance))
    wide = np.zeros((len(mean), rows.shape[1]))
    wide[:, np.r_[tuple(places[i] for i in map(effects.index, more))]] = whiten
    return Knowledge(
        effects, np.concatenate([rows, wide]), np.concatenate([known.target, whiten @ mean])
    )


def total_mass_row(robot: Robot, base: BaseParameters) -> Array:
    """w (r,) with wᵀ φ_B the mass of all bodies [kg], links that are locked or held among them.

    mappingᵀ w is the indicator of the masses.

    Raises
    ------
    ConfigError
        The whole mass does not show in the measured rows.
    """
    masses = np.zeros(base.mapping.shape[1])
    masses[robot.massless * PARAMETERS_PER_BODY :: PARAMETERS_PER_BODY] = 1.0
    w = np.asarray(lstsq(base.mapping.T, masses)[0])
    if not robot.base_joints or np.abs(base.mapping.T @ w - masses).max() > _VISIBLE:
        raise ConfigError(
            "identification.total_mass: the whole mass of this robot does not show in what is "
            "measured. It does in the wrench at a floating base with gravity (robot.base: "
            "floating, robot.rows with base). Without that, weigh a payload instead and record a "
            "run with it: identification.known_payload."
        )
    return w


def assumed_scale(measurement: MeasurementSpec, spec: IdentificationSpec) -> list[Finding]:
    """That what is found has the scale of constants that somebody gave, if nothing tells it."""
    told = (spec.known_payload, spec.total_mass, spec.gain_std)
    of = torque_source(measurement).scaled_by
    if any(each is not None for each in told) or not of:
        return []
    text = (
        f"masses, friction and loads have the scale of measurement.{of} as given, and their ± know "
        "nothing of its error. A payload of known mass on a run determines it "
        "(identification.known_payload); identification.gain_std: 0.1 puts 10 % into every ±."
    )
    return [Finding("assumed_scale", "note", text)]


def unseen_load(spec: IdentificationSpec, gains: Mapping[str, float]) -> list[Finding]:
    """That what was weighed does not show: then gains of joints come out as nearly no torque."""
    least = min(gains.values(), default=0.0)
    if (spec.known_payload is None and spec.total_mass is None) or least > _NO_TORQUE:
        return []
    key = KNOWN_LOAD if spec.known_payload is not None else KNOWN_MASS
    text = (
        f"the known mass ({key}) does not show in the torques: gains down to {least:+.0%} would "
        "be needed. Is it on these runs and this link, and its mass in kg?"
    )
    return [Finding("unseen_load", "warning", text, joints=tuple(gains))]


def known_body(spec: KnownPayloadSpec, robot: Robot) -> tuple[Effect, Array, Array]:
    """The payload as an effect of its runs; mean (10,) and covariance (10, 10) of its values."""
    where = "identification.known_payload.link"
    frame = (
        own_link(robot, robot.n - 1) if spec.link is None else link_frame(robot, spec.link, where)
    )
    mass, about = spec.mass, 0.4 * spec.mass * _RADIUS**2
    inertia = (about, 0.0, about, 0.0, 0.0, about) if spec.inertia is None else spec.inertia
    numbers = np.array([mass, *spec.center, *inertia])
    principal = np.linalg.eigvalsh(np.array(inertia)[SIX_AT])
    if principal[0] < 0.0 or principal[2] > (1.0 + _LEAST) * (principal[0] + principal[1]):
        raise ConfigError(
            "identification.known_payload.inertia: no body has it: its principal moments are "
            f"{', '.join(f'{x:.3g}' for x in principal)} kg·m², and of three none is negative or "
            "more than the others together. The order is Ixx, Ixy, Iyy, Ixz, Iyz, Izz, about the "
            "centre of mass."
        )
    loose = mass * _RADIUS**2 if spec.inertia is None else 0.1 * max(map(abs, inertia))
    std = np.array(
        [
            max(spec.std, _LEAST * mass),
            *[max(spec.center_std, _LEAST)] * 3,
            *[max(loose, _LEAST * about)] * 6,
        ]
    )
    back = moved(frame.rotation.T, -frame.rotation.T @ frame.translation)
    slope = back @ slopes(about_frame, numbers, 1e-4 * np.maximum(std, 1e-6))
    covariance = (slope * std**2) @ slope.T
    return carried_body(frame.joint, spec.runs), back @ about_frame(numbers), covariance
