"""Could these be the robot's torques and positions? Order and signs, judged with the URDF.

A mistake in the file is not an effect of the robot, and a diagnosis of such data would be wrong
from the start. So mistakes are tried out (`rearranged`): one is reported if, undone, it leaves
clearly less of the torques (`torque_shares`, which allow for wrong inertias) than the data as they
are, and no joint fits clearly worse. It is an error where hardly anything of the torques concerned
fits as they are, whatever the inertias, and nearly all of it the other way round; else a warning,
and the person decides. Whatever no such mistake explains is left to the diagnosis.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.spec import Spec
from excite_cli.diagnosis.clock_by_gravity import check_clock
from excite_cli.diagnosis.foreign_torques import check_runs
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
from excite_cli.diagnosis.standing_legs import refuse_standing
from excite_cli.diagnosis.torque_scale import check_scale
from excite_cli.diagnosis.torque_shares import RoughModel, Samples, samples_of, those
from excite_cli.errors import FileError
from excite_cli.identification.motion_errors import check_motion
from excite_cli.identification.prepare import PreparedRun, prepare_all
from excite_cli.identification.processing import Processing, choose_processing
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.robot.model import Robot

_SAMPLES, _FEW = 600, 200
_GOOD = 0.03  # data that leave less than this on every joint are what they say they are
_WORSE = 0.3  # log of the share by which no joint may fit worse; or share of the whole gain
_FITS = 0.6  # share that the joints concerned may have left, in the median
# Exchanged wrists of wrong inertias may fit somewhat better: that is no evidence of an order.
_ORDER_FITS = 0.35
_FOREIGN = 0.85  # torques of which this is left have nothing to do with the motion
# Shares left as the data are, from which a mistake is certain (inertias would have to be 5 standard
# deviations off), and most that may be left without it.
_CERTAIN, _EXPLAINED = 0.15, 0.1


def check_dataset(
    robot: Robot, dataset: Dataset, spec: Spec, sealed: str | None = None
) -> tuple[Finding, ...]:
    """As `check_recorded`, for all runs but the sealed part, filtered as `spec` says.

    Raises
    ------
    FileError
        As `check_plausibility`; or a run is too short for the filters.
    """
    needed = spec.identification.needed_runs
    runs = split(dataset, sealed, spec.diagnosis.block, needed).training
    processing = choose_processing(runs, spec.measurement.filter, spec.diagnosis.moving_speed)
    prepared = prepare_all(runs, processing)
    return check_recorded(robot, runs, prepared, processing, spec.measurement)


def check_recorded(
    robot: Robot,
    runs: Sequence[Run],
    prepared: Sequence[PreparedRun],
    processing: Processing,
    declared: MeasurementSpec,
) -> tuple[Finding, ...]:
    """What is to be known of the runs that are fitted: motion, clock, and `check_plausibility`.

    A cut-off of the positions that is `declared` is taken as it is; so is all else with `trust`.

    Raises
    ------
    FileError
        As `check_plausibility`.
    """
    motion: tuple[Finding, ...] = ()
    if declared.filter.position == "auto":
        motion = check_motion(runs, processing, robot.joint_names)
    if declared.trust:
        return motion
    samples = samples_of(prepared, _SAMPLES)
    if not len(samples.q):  # nobody moves: there is nothing to judge
        return motion
    clock = check_clock(robot, runs, samples)
    return (*motion, *clock, *check_plausibility(robot, prepared, samples, declared))


def check_plausibility(
    robot: Robot, runs: Sequence[PreparedRun], samples: Samples, declared: MeasurementSpec
) -> tuple[Finding, ...]:
    """What order of columns or signs seem to contradict the robot: findings of severity `warning`.

    `samples` of all runs. Signs that are `declared` for a joint, as they are or not, are taken as
    they are.

    Raises
    ------
    FileError
        The robot stands and is declared to hang; columns are in another order, or torques or
        positions of joints have the opposite sign, whatever the inertias.
    """
    model = RoughModel(robot)
    scale = check_scale(model, samples, declared)
    if any(found.kind == "no_gravity" for found in scale):
        return scale  # order and signs are judged by the whole torque
    refuse_standing(robot, samples.thinned(_FEW))
    foreign = check_runs(model, runs)
    return (*scale, *(foreign or _check_arrangement(samples, model, declared)))


def _check_arrangement(
    samples: Samples, model: RoughModel, declared: MeasurementSpec
) -> tuple[Finding, ...]:
    """Order of columns, and signs, of all joints with a torque."""
    names, n = model.robot.joint_names, model.robot.n
    table, here = model.shares_left(samples), np.arange(n)
    without = np.asarray(~samples.known.any(axis=0))
    table[without] = table[:, without] = 1.0
    table[without, without] = 0.0
    straight = Verdict(Change.none(n), table[here, here, 0])
    if straight.left.max() < _GOOD:
        return ()
    signs = (declared.sign, declared.position_sign)
    settled = np.array([[name in given for name in names] for given in signs])
    tried = [*torques_changed(table), *positions_changed(model, samples, without)]
    found = [
        v for v in tried if _clearly_better(v, straight) and not (v.change.signs & settled).any()
    ]
    best = min(found, key=lambda verdict: verdict.cost, default=None)
    if best is None or np.median(best.left[best.change.touched]) > _FITS:
        if np.mean(straight.left > _FOREIGN) >= 0.5:
            raise FileError(_foreign(names, straight))
        return ()
    found += mirrored(model, samples, best.change) if best.change.mistakes == 1 else []
    rivals = [v for v in found if v.cost < best.cost + PRICE and v is not best]
    text = _message(names, straight, best, rivals)
    if _certain(best, straight):
        raise FileError(f"the measured data contradict the robot: {text}")
    text = f"the measured data may contradict the robot: {text.removesuffix('.')}"
    return (Finding("implausible", "warning", text, "", those(names, best.change.touched)),)


def _clearly_better(verdict: Verdict, straight: Verdict) -> bool:
    """Whether a change gains enough on the joints it is about, and costs none of the others."""
    change = verdict.change
    if not change.mistakes:
        return False
    gain = logs(straight.left) - logs(verdict.left)
    touched = change.touched
    left = verdict.left[touched]
    fits = bool(np.median(left) < _FITS)
    if change.exchanges:
        foreign = np.median(straight.left[touched]) > _FOREIGN
        fits = bool(left.max() < _ORDER_FITS or (foreign and np.median(left) < 1.4 * _ORDER_FITS))
    turned = (change.tau_sign < 0) & (change.q_sign > 0)
    return bool(
        gain.sum() > CLEAR * change.exchanges + SIGN * (change.mistakes - change.exchanges)
        and gain.min() > -max(_WORSE, _WORSE * gain.sum())
        and (turned.all() or (gain[turned] > SIGN).all())
        and gain[touched].mean() > 0.5 * SIGN
        and fits
    )


def _certain(best: Verdict, straight: Verdict) -> bool:
    """Whether no inertias could make the torques concerned what they are recorded as."""
    touched = best.change.touched
    before, after = straight.left[touched], best.left[touched]
    judged = (before > 0.0).all()  # nothing at all is left of joints that hardly move
    return bool(judged and np.median(before) > _CERTAIN and np.median(after) < _EXPLAINED)


def _message(names: Sequence[str], straight: Verdict, best: Verdict, rivals: list[Verdict]) -> str:
    """One sentence on what is wrong, how sure that is, and what to write in the YAML."""
    what = _sentences(names, best.change)
    gain = np.abs(logs(straight.left) - logs(best.left)) > 0.1
    shown = gain if gain.any() else best.change.touched
    before, after = (np.sqrt(np.mean(each.left[shown] ** 2)) for each in (straight, best))
    text = (
        f"{what}. As they are, {before:.0%} of these torques do not fit the URDF "
        f"with any friction or stiffness; that way {after:.0%}."
    )
    others = dict.fromkeys(_sentences(names, rival.change) for rival in rivals)
    others.pop(what, None)
    if others:
        text += f" As likely: {'. Or: '.join(others)}."
    return f"{text} {_settling(names, best.change)}"


def _settling(names: Sequence[str], change: Change) -> str:
    """The key that ends the discussion where the data are right all the same."""
    keys = []
    for key, wrong in zip(("sign", "position_sign"), change.signs, strict=True):
        if wrong.any():
            joints = ", ".join(f"{name}: 1" for name in those(names, wrong))
            keys.append(f"measurement.{key}: {{{joints}}}")
    said = "measurement.trust: true" if change.exchanges else " and ".join(keys)
    return f"If the data are right as they are, say so: {said}."


def _foreign(names: Sequence[str], straight: Verdict) -> str:
    """Torques that do not belong to the motion, for a reason that cannot be named."""
    wrong = ", ".join(those(names, straight.left > _FITS))
    return (
        f"the measured data contradict the robot: the torques of {wrong} do not fit their motion "
        "with any friction or stiffness, and no single exchange or sign explains it. Check the "
        "order and the signs of all columns (measurement.names, sign, position_sign), what the "
        "torque is (measurement.torque), and whether this is the robot's URDF. If the data are "
        "right as they are, say so: measurement.trust: true."
    )


def _sentences(names: Sequence[str], change: Change) -> str:
    """All that went wrong, by a change that undoes it."""
    here = np.arange(len(names))
    found = []
    if (change.q_order != here).any():
        together = bool((change.q_order == change.tau_order).all())
        what = "columns" if together else "positions"
        found.append(_order(names, change.q_order, what, together))
    elif (change.tau_order != here).any():
        found.append(_order(names, change.tau_order, "torques", False))
    for word, key, turned in zip(
        ("torque", "position"), ("sign", "position_sign"), change.signs, strict=True
    ):
        if wrong := those(names, turned):
            whose = "every joint" if len(wrong) == len(names) > 1 else ", ".join(wrong)
            setting = ", ".join(f"{name}: -1" for name in wrong)
            found.append(
                f"the {word} of {whose} has the opposite sign "
                f"(set measurement.{key}: {{{setting}}})"
            )
    return "; and ".join(found)


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
