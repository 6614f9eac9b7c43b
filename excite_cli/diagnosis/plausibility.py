"""Could these be the robot's torques and positions? Order and signs, judged with the URDF.

A mistake in the file is not an effect of the robot, and a diagnosis of such data would be wrong
from the start. So mistakes are tried out (`rearranged`): one is reported if, undone, it leaves
clearly less of the torques (`torque_shares`) than the data as they are, and no joint fits clearly
worse. Whatever no such mistake explains is left to the diagnosis.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.config.spec import Spec
from excite_cli.diagnosis.rearranged import (
    CLEAR,
    PRICE,
    SIGN,
    Change,
    Order,
    Verdict,
    logs,
    mirrored,
    positions_changed,
    torques_changed,
)
from excite_cli.diagnosis.torque_shares import Samples, columns_of, samples_of, shares_left
from excite_cli.dynamics.inverse_dynamics import InverseDynamics
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.errors import FileError
from excite_cli.identification.prepare import PreparedRun, prepare
from excite_cli.identification.prior import inertial_prior
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Dataset
from excite_cli.robot.model import Array, Robot

_SAMPLES = 600
_GOOD = 0.1  # data that leave less than this on every joint are what they say they are
_WORSE = 0.3  # log of the share by which no joint may fit worse; or share of the whole gain
_FITS = 0.6  # share that the joints concerned may have left, in the median
# Exchanged wrists of wrong inertias may fit somewhat better: that is no evidence of an order.
_ORDER_FITS = 0.35
# How wrong inertias may be [share], how far beyond that torques must be for an exchange or for
# another sign to be judged, and from how many joints on most of them suffice.
_UNCERTAIN, _BEYOND, _BEYOND_SIGN, _MANY = 0.3, 2.0, 2.3, 3
_FOREIGN = 0.85  # torques of which this is left have nothing to do with the motion


def check_plausibility(robot: Robot, runs: Sequence[PreparedRun]) -> None:
    """Refuse data whose order of columns or whose signs contradict the robot.

    Raises
    ------
    FileError
        Columns are in another order, or torques or positions of joints have the opposite sign.
    """
    samples, dynamics = samples_of(runs, _SAMPLES), InverseDynamics(robot)
    table = shares_left(
        columns_of(dynamics, samples.q, samples.v, samples.a), samples.tau, samples.usable
    )
    here = np.arange(robot.n)
    straight = Verdict(Change.none(robot.n), table[here, here, 0])
    if straight.left.max() < _GOOD:
        return
    tried = [*torques_changed(table), *positions_changed(dynamics, samples)]
    excess = _excess(robot, samples)
    found = [verdict for verdict in tried if _clearly_better(verdict, straight, excess)]
    if not found:
        if np.mean((straight.left > _FOREIGN) & (excess > _BEYOND)) >= 0.5:
            raise FileError(_foreign(robot.joint_names, straight))
        return
    best = min(found, key=lambda verdict: verdict.cost)
    if np.median(best.left) > _FITS:
        raise FileError(_foreign(robot.joint_names, straight))
    found += mirrored(dynamics, samples, best.change) if best.change.mistakes == 1 else []
    rivals = [v for v in found if v.cost < best.cost + PRICE and v is not best]
    raise FileError(_message(robot.joint_names, straight, best, rivals))


def check_dataset(robot: Robot, dataset: Dataset, spec: Spec) -> None:
    """As `check_plausibility`, for all runs as they were read, filtered as `spec` says.

    Raises
    ------
    FileError
        As `check_plausibility`; or a run is too short for the filters.
    """
    processing = choose_processing(
        dataset.runs, spec.measurement.filter, spec.diagnosis.moving_speed
    )
    check_plausibility(robot, [prepare(run, processing) for run in dataset.runs])


def _excess(robot: Robot, samples: Samples) -> Array:
    """How much more torque (n,) varies than inertias that are somewhat wrong could make it vary.

    A wrist that carries next to nothing may have its small torque turned round by a centre of mass
    a few millimetres off; its sign says nothing.
    """
    cad = standard_parameters(robot)
    std = inertial_prior(robot, cad, _UNCERTAIN).std
    body = RigidBody(robot, cad, samples.q, samples.v, samples.a)
    made_up = np.sqrt(np.var(body.regressor, axis=0) @ np.square(std))
    measured = np.std(samples.tau, axis=0)  # a constant is an offset, whatever its sign
    return np.asarray(measured / np.maximum(made_up, 1e-300))


def _clearly_better(verdict: Verdict, straight: Verdict, excess: Array) -> bool:
    """Whether a change gains enough on the joints it is about, and costs none of the others."""
    if not verdict.change.mistakes:
        return False
    here = np.arange(len(excess))
    ordered = (verdict.change.q_order == here).all() and (verdict.change.tau_order == here).all()
    sure = excess[verdict.change.touched] > (_BEYOND_SIGN if ordered else _BEYOND)
    if not (sure.all() if len(sure) < _MANY else sure.mean() >= 0.5):
        return False
    gain = logs(straight.left) - logs(verdict.left)
    touched = verdict.change.touched
    left = verdict.left[touched]
    fits = bool(np.median(left) < _FITS)
    if not ordered:
        foreign = np.median(straight.left[touched]) > _FOREIGN
        fits = bool(left.max() < _ORDER_FITS or (foreign and np.median(left) < 1.4 * _ORDER_FITS))
    turned = (verdict.change.tau_sign < 0) & (verdict.change.q_sign > 0)
    return bool(
        gain.sum() > CLEAR * verdict.change.mistakes
        and gain.min() > -max(_WORSE, _WORSE * gain.sum())
        and (turned.all() or (gain[turned] > SIGN).all())
        and gain[touched].mean() > 0.5 * CLEAR
        and fits
    )


def _message(names: Sequence[str], straight: Verdict, best: Verdict, rivals: list[Verdict]) -> str:
    """One sentence on what is wrong, how sure that is, and what to write in the YAML."""
    parts = _sentences(names, best.change)
    gain = np.abs(logs(straight.left) - logs(best.left)) > 0.1
    shown = gain if gain.any() else best.change.touched
    before, after = _rms(straight.left[shown]), _rms(best.left[shown])
    text = (
        f"the measured data contradict the robot: {'; and '.join(parts)}. As they are, "
        f"{before:.0%} of these torques do not fit the URDF with any friction or stiffness; that "
        f"way {after:.0%}."
    )
    others = dict.fromkeys("; and ".join(_sentences(names, rival.change)) for rival in rivals)
    others.pop("; and ".join(parts), None)
    if others:
        text += f" As likely: {'. Or: '.join(others)}."
    return text


def _foreign(names: Sequence[str], straight: Verdict) -> str:
    """Torques that do not belong to the motion, for a reason that cannot be named."""
    wrong = ", ".join(names[j] for j in np.flatnonzero(straight.left > _FITS).tolist())
    return (
        f"the measured data contradict the robot: the torques of {wrong} do not fit their motion "
        "with any friction or stiffness, and no single exchange or sign explains it. Check the "
        "order and the signs of all columns (measurement.names, sign, position_sign), what the "
        "torque is (measurement.torque), and whether this is the robot's URDF."
    )


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _sentences(names: Sequence[str], change: Change) -> list[str]:
    n = len(names)
    here = np.arange(n)
    found = []
    if (change.q_order != here).any():
        together = bool((change.q_order == change.tau_order).all())
        what = "columns" if together else "positions"
        found.append(_order(names, change.q_order, what, together))
    elif (change.tau_order != here).any():
        found.append(_order(names, change.tau_order, "torques", False))
    for sign, word, key in (
        (change.tau_sign, "torque", "sign"),
        (change.q_sign, "position", "position_sign"),
    ):
        wrong = np.flatnonzero(sign < 0).tolist()
        if len(wrong):
            whose = "every joint" if len(wrong) == n > 1 else ", ".join(names[j] for j in wrong)
            setting = ", ".join(f"{names[j]}: -1" for j in wrong)
            found.append(
                f"the {word} of {whose} has the opposite sign "
                f"(set measurement.{key}: {{{setting}}})"
            )
    return found


def _order(names: Sequence[str], columns: Order, what: str, nameable: bool) -> str:
    """What stands where, and how to name it if the config can: column `order[j]` is joint j's."""
    order: list[int] = columns.tolist()
    moved = [j for j in range(len(names)) if order[j] != j]
    if len(moved) == 2:
        words = f"the {what} of {names[moved[0]]} and {names[moved[1]]} are swapped"
    else:
        listed = ", ".join(f"{names[order[j]]} holds {names[j]}" for j in moved)
        words = f"the {what} are in another order than their names ({listed})"
    if nameable:
        mapping = ", ".join(f"{names[order[j]]}: {names[j]}" for j in moved)
        return f"{words} (set measurement.names: {{{mapping}}})"
    return f"{words} (correct the names of these columns in the file)"
