"""What the robot carries, on top of a fit of the robot without it: mass, centre and inertia.

The fit's parameters are known as well as it says, ‖L⁻¹ (x − x_fit)‖² with L Lᵀ its covariance, and
fitted once more with the ten of the load: the intervals of the load hold what is uncertain of the
robot. All samples are fitted; what is left beside the fit without the load says whether it is one.

A gain has the torque of the fit in its column, and of the load what is found. Gains and parameters
of the robot that nobody weighed are uncertain together along x (1 + g) = const, which a covariance
has as a straight line: columns that moved along the curve would take its bend for knowledge of g.
"""

from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import IdentificationSpec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import carried_body
from excite_cli.effects.judgement import half_of
from excite_cli.effects.parameter import Value, deviation
from excite_cli.effects.signals import Signals
from excite_cli.errors import ConfigError, FileError
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.filter_bias import filter_findings
from excite_cli.identification.fit import Fit, fit
from excite_cli.identification.identify import judged
from excite_cli.identification.link_changes import about_centre, about_frame, slopes
from excite_cli.identification.prepare import PreparedRun, require_motion
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.regression import (
    Regression,
    Series,
    effect_columns,
    rebuilt,
    regression_on,
    signals_of,
    with_effects,
)
from excite_cli.identification.stored_model import StoredFit
from excite_cli.measurement.dataset import Dataset, Finding
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.link_frame import LinkFrame, carrying_frame
from excite_cli.robot.model import Array, Robot
from excite_cli.shown.answer import Shown

_TIMES_THE_FIT = 2.0  # of the error that the fit had: more is no load
_COMPACT = 0.05  # m, radius of the load that a motion is planned for, and how far off it hangs
_WIDTH = 10  # of a body
_REBUILDS, _SETTLED = 6, 1e-6
# What no noise explains, one standard deviation each: of 48 loads on 16 simulated robots 93 % of
# the 95 % intervals held the truth without it, of 40 on 40 robots 89 %; of the 48, 98 % with it.
_SCALE, _PLACE = 1e-3, 1e-4  # share of the whole body; m of its centre
_TENSOR = ("Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


@dataclass(frozen=True, repr=False)
class LoadIdentification(Shown):
    """The load on `link`, which moved joint `joint` carries.

    `values` (10,) and `covariance` (10, 10) are mass, first moments and moments of inertia in the
    frame of the link; `parameters` by name mass [kg], cx, cy, cz [m] in that frame, and the inertia
    about the centre of mass [kg·m²], with one standard deviation. `possible`: some body has these
    numbers, or the nearest of one is within their error. `without`, `with_load`: errors of the
    torque of the fit as stored, and with the load; `fit_error`: mean error that the fit had on data
    it had not seen, where joints move.
    """

    link: str
    joint: str
    values: Array
    covariance: Array
    parameters: dict[str, Value]
    possible: bool
    without: Errors
    with_load: Errors
    fit_error: float
    seconds: float
    findings: tuple[Finding, ...] = ()


def identify_load(
    robot: Robot,
    base: BaseParameters,
    dataset: Dataset,
    spec: Spec,
    stored: StoredFit,
    link: str | None = None,
) -> LoadIdentification:
    """The load that the robot carries in all runs of `dataset`.

    Raises
    ------
    ConfigError
        The link is unknown, or must be named; the data do not show all ten parameters there.
    FileError
        The fit is of another robot, or of a payload in all runs; a run is too short.
    """
    frame, load, alone, known = _begun(robot, base, stored, link)
    if load in alone.effects:
        raise FileError("--fit: it has a payload in all runs itself. Identify the robot without.")
    effects = (*_as_fitted(alone, robot), load)
    processing = choose_processing(
        dataset.runs, spec.measurement.filter, spec.diagnosis.moving_speed
    )
    # What the URDF says of the robot is in its fit, and no consistent bodies are wanted here.
    plain = spec.identification.model_copy(update={"inertias": "free", "consistent": False})

    def behind(other: Processing) -> tuple[list[PreparedRun], Fit]:
        made = regression_on(robot, base, effects, dataset.runs, other)
        runs = [run.prepared for run in made.runs]
        unmeasured = (*spec.measurement.without_torque, *robot.unmeasured)
        require_motion(runs, other, robot.joint_names, unmeasured)
        return runs, _fitted(made, plain, known)

    runs, found = behind(processing)
    biased = filter_findings(
        dataset.runs, processing, spec.measurement.filter, lambda other: behind(other)[1], found
    )
    without, with_load = (judged(robot, each, runs, held_out=False)[0] for each in (alone, found))
    at = slice(len(found.values) - _WIDTH, None)
    own, spread = found.values[at], found.covariance[at, at]
    if not np.isfinite(spread).all():
        raise ConfigError(
            f"--link: these data do not show all ten parameters of a load on {frame.name}: too few "
            "joints turn it, or too little. Name a link further out, or play a motion that "
            "`excite optimize --for payload` plans."
        )
    turned = load.seen_from(frame)
    values = turned @ own
    spread_there = _with_systematic(values, turned @ spread @ turned.T)
    possible = load.possible(own) or not load.why_impossible(own, spread)
    fit_error = stored.error.mean_relative_moving
    return LoadIdentification(
        link=frame.name,
        joint=robot.joint_names[frame.joint],
        values=values,
        covariance=spread_there,
        parameters=_parameters(values, spread_there),
        possible=possible,
        without=without,
        with_load=with_load,
        fit_error=fit_error,
        seconds=float(sum(run.duration for run in dataset.runs)),
        findings=(*dataset.findings, *biased, *_noticed(with_load, fit_error, possible)),
    )


def _fitted(regression: Regression, plain: IdentificationSpec, known: tuple[Array, Array]) -> Fit:
    """The fit, with columns that follow what was found: gains act upon the load, too."""
    rank = regression.base.rank
    found = fit(regression, plain, known)
    for _ in range(_REBUILDS):
        regression = rebuilt(regression, found.phi, found.values[rank:])
        last, found = found, fit(regression, plain, known)
        change = np.linalg.norm(found.values - last.values)
        if change <= _SETTLED * np.linalg.norm(found.values):
            break
    return found


@dataclass(frozen=True)
class ExpectedLoad:
    """Deviations that a motion will leave of a load of `mass` [kg]: of it [kg], of its centre [m].

    `center_std` is that of the axis of which least is known.
    """

    mass: float
    mass_std: float
    center_std: float


def expected_load(
    robot: Robot,
    base: BaseParameters,
    stored: StoredFit,
    link: str | None,
    motion: tuple[Array, Array, Array, Array],
    mass: float = 1.0,
) -> ExpectedLoad:
    """How well `identify_load` will tell a compact load of `mass` after a motion t, q, v, a.

    With samples at the rate of the fit's averages, of its noise, each worth the share of
    independent ones that the fit's had; t (T,) is that of the samples.
    """
    frame, load, alone, known = _begun(robot, base, stored, link)
    signals = signals_of(Series(*motion), robot, alone.phi)
    seen = with_effects(signals, alone.effects, alone.values[alone.rank :])
    blocks = (
        signals.body.regressor[:, :, base.selection],
        effect_columns(alone.effects, seen),
        load.columns(seen),
    )
    share = np.sqrt(np.clip(alone.samples / max(alone.count, 1), 1e-3, 1.0))
    rows = np.concatenate(blocks, axis=2) * (share / alone.noise)[:, None]
    every = np.concatenate([rows.reshape(-1, rows.shape[2]), known[0]])
    size = np.maximum(np.linalg.norm(every, axis=0), 1e-300)
    spread = np.linalg.pinv(every / size)
    spread = (spread @ spread.T / np.outer(size, size))[-_WIDTH:, -_WIDTH:]
    turned = load.seen_from(frame)
    about = 0.4 * mass * _COMPACT**2
    values = about_frame(np.array([mass, 0.0, 0.0, _COMPACT, about, 0.0, about, 0.0, 0.0, about]))
    told = _parameters(values, _with_systematic(values, turned @ spread @ turned.T))
    return ExpectedLoad(mass, told["mass"].std, max(told[name].std for name in ("cx", "cy", "cz")))


def require_same(robot: Robot, base: BaseParameters, stored: StoredFit) -> None:
    """Refuse a fit that is not of this robot.

    Raises
    ------
    FileError
        It was made for another one.
    """
    if stored.fingerprint != robot.fingerprint() or stored.fit.rank != base.rank:
        raise FileError(
            "--fit: it was made for another robot, other moved joints, posture or rows. Give the "
            "config that it was made with."
        )


def _begun(
    robot: Robot, base: BaseParameters, stored: StoredFit, link: str | None
) -> tuple[LinkFrame, Effect, Fit, tuple[Array, Array]]:
    """Where the load hangs, the load, the fit without effects of single runs, what is known of it.

    That is rows on [parameters of the fit, those of the load], and their target; nothing of
    parameters that the fit did not see.
    """
    require_same(robot, base, stored)
    frame = carrying_frame(robot, link, "--link")
    fit = stored.fit
    kept = [True, *(not effect.runs for effect in fit.effects)]
    at = np.repeat(kept, [fit.rank, *(len(effect.parameters) for effect in fit.effects)])
    effects = tuple(effect for effect in fit.effects if not effect.runs)
    alone = replace(fit, effects=effects, values=fit.values[at])
    covariance = fit.covariance[np.ix_(at, at)]
    seen = np.flatnonzero(np.isfinite(np.diag(covariance)))
    whiten = np.linalg.inv(half_of(covariance[np.ix_(seen, seen)]))
    rows = np.zeros((len(seen), len(alone.values) + _WIDTH))
    rows[:, seen] = whiten
    return frame, carried_body(frame.joint), alone, (rows, whiten @ alone.values[seen])


def _as_fitted(alone: Fit, robot: Robot) -> list[Effect]:
    """The effects of a fit, those of the whole torque with the torque that was fitted."""
    fitted: dict[tuple[RunId, int], Signals] = {}

    def of_fit(signals: Signals) -> Signals:
        key = signals.run, len(signals.t)
        if key not in fitted:
            body = RigidBody(robot, alone.phi, signals.q, signals.v, signals.a)
            seen = replace(signals, load=body.load, torque=body.load, body=body)
            fitted[key] = with_effects(seen, alone.effects, alone.values[alone.rank :])
        seen, carried = fitted[key], signals.load - signals.body.load
        return replace(seen, load=seen.load + carried, torque=seen.torque + carried)

    def held(effect: Effect) -> Effect:
        kind = type(effect)
        own = {"columns": lambda self, signals: kind.columns(self, of_fit(signals))}
        like: type[Effect] = type(kind.__name__, (kind,), own)
        return like(effect.joints, effect.shape, effect.runs, effect.covariate)

    return [held(each) if each.of_whole_torque else each for each in alone.effects]


def _with_systematic(values: Array, covariance: Array) -> Array:
    """The covariance (10, 10) with an uncertain scale of the body and place of its centre."""
    place = np.zeros(_WIDTH)
    place[1:4] = _PLACE * values[0]
    return np.asarray(covariance + _SCALE**2 * np.outer(values, values) + np.diag(place**2))


def _parameters(values: Array, covariance: Array) -> dict[str, Value]:
    """Mass, centre, and inertia about the centre, deviations to first order."""
    steps = 1e-6 * np.maximum(np.sqrt(np.diag(covariance)), 1e-12)
    by_number = zip(about_centre(values), slopes(about_centre, values, steps), strict=True)
    names = ("mass", "cx", "cy", "cz", *_TENSOR)
    units = ("kg", "m", "m", "m", *["kg·m²"] * 6)
    return {
        name: Value(float(value), deviation(slope, covariance), unit)
        for name, unit, (value, slope) in zip(names, units, by_number, strict=True)
    }


def _noticed(with_load: Errors, fit_error: float, possible: bool) -> list[Finding]:
    found = []
    if not possible:
        text = (
            "mass, centre and inertia are physically infeasible, also within their error: the "
            "residual is not a payload alone. Move longer, or identify the robot again."
        )
        found.append(Finding("impossible_load", "warning", text))
    left = with_load.mean_relative_moving
    if left > _TIMES_THE_FIT * fit_error:
        text = (
            f"the residual with the payload is {left:.1%} of the torque, that of the fit was "
            f"{fit_error:.1%}: the robot changed, or carries more than a rigid body, and the ± "
            "below do not cover this. Identify the robot again, on the same day."
        )
        found.append(Finding("more_than_a_load", "warning", text))
    return found
