"""Traces as HDF5 groups: arrays compressed in single precision, the rest as attributes."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.traces import Dependence, EffectTrace, Traces
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array
from excite_cli.store import checked

# Errors and noise floors of a file: of the joints that the file names.


def require_joints(
    joints: Sequence[str], errors: Sequence[Errors], noise_floor: Mapping[str, float] | None
) -> None:
    """Raise ValueError where they are of other joints."""
    found: list[Mapping[str, float]] = [
        mapping
        for each in errors
        for mapping in (each.relative, each.relative_moving, each.rms, each.rms_raw)
    ]
    found += [each.samples for each in errors if each.samples]
    others = set(noise_floor or ()) - set(joints)
    if others or any(set(mapping) != set(joints) for mapping in found):
        raise ValueError("its errors are those of other joints")


_TORQUE = ("q", "v", "a", "load", "measured", "predicted")
_EFFECT = ("x", "own", "partial")
_TEXTS = ("kind", "quantity", "unit", "covariate")


def write_torque_traces(group: Any, traces: Sequence[TorqueTrace]) -> None:
    """One numbered group for every trace."""
    for number, trace in enumerate(traces):
        own = group.create_group(str(number))
        own.attrs.update({"run": trace.run, "held_out": trace.held_out})
        arrays = {name: getattr(trace, name) for name in ("t", *_TORQUE)}
        if trace.before is not None:
            arrays["before"] = trace.before
        _write_arrays(own, arrays)
        _write(own, "counted", np.asarray(trace.counted, dtype=bool))


def read_torque_traces(group: Any, joints: int) -> tuple[TorqueTrace, ...]:
    """The traces in their order, of a robot with so many joints.

    Raises
    ------
    ValueError
        Arrays do not fit together.
    """
    return tuple(_torque_trace(group[str(number)], joints) for number in range(len(group)))


def _torque_trace(own: Any, joints: int) -> TorqueTrace:
    t = checked.array(own["t"], (None,))
    shape = (len(t), joints)
    arrays: dict[str, Any] = {
        name: checked.array(own[name], shape, finite=False) for name in _TORQUE
    }
    stored = "before" in own
    return TorqueTrace(
        run=checked.text(own.attrs, "run"),
        held_out=checked.flag(own.attrs, "held_out"),
        t=t,
        counted=checked.flags(own["counted"], shape),
        before=checked.array(own["before"], shape, finite=False) if stored else None,
        **arrays,
    )


def write_traces(group: Any, traces: Traces) -> None:
    """Traces of the training data of a diagnosis."""
    group.attrs["torque_units"] = json.dumps(traces.torque_units)
    write_torque_traces(group.create_group("runs"), traces.runs)
    effects = group.create_group("effects")
    for number, trace in enumerate(traces.effects):
        own = effects.create_group(str(number))
        names = {"joints": trace.joints, "runs": trace.runs, "rows": trace.rows}
        own.attrs.update({name: json.dumps(value) for name, value in names.items()})
        own.attrs.update({name: getattr(trace, name) for name in _TEXTS})
        own.attrs["period"] = np.nan if trace.period is None else trace.period
        _write_arrays(own, {name: getattr(trace, name) for name in ("part", "t", *_EFFECT)})
    dependence = group.create_group("dependence")
    dependence.attrs["joints"] = json.dumps(traces.dependence.joints)
    dependence.attrs["quantities"] = json.dumps(
        [each.code for each in traces.dependence.quantities]
    )
    dependence["shares"] = np.asarray(traces.dependence.shares, dtype=float)


def read_traces(group: Any, joints: Sequence[str]) -> Traces:
    """What `write_traces` wrote, of a robot with these joints.

    Raises
    ------
    ValueError
        Arrays do not fit together, or joints are others.
    """
    effects, dependence = group["effects"], group["dependence"]
    rows = _names(dependence, "joints")
    quantities = tuple(Covariate.of_code(code) for code in _names(dependence, "quantities"))
    found = Traces(
        torque_units=_names(group, "torque_units"),
        runs=read_torque_traces(group["runs"], len(joints)),
        effects=tuple(_effect(effects[str(number)]) for number in range(len(effects))),
        dependence=Dependence(
            rows,
            quantities,
            checked.array(dependence["shares"], (len(rows), len(quantities)), finite=False),
        ),
    )
    named = {joint for each in found.effects for joint in (*each.joints, *each.rows)}
    if not named | set(rows) <= set(joints) or len(found.torque_units) != len(joints):
        raise ValueError("its traces are those of other joints")
    return found


def _effect(own: Any) -> EffectTrace:
    rows, t = _names(own, "rows"), checked.array(own["t"], (None,))
    arrays: dict[str, Any] = {
        name: checked.array(own[name], (len(t), len(rows)), finite=False) for name in _EFFECT
    }
    period = checked.number(own.attrs, "period")
    texts: dict[str, Any] = {name: checked.text(own.attrs, name, "") for name in _TEXTS}
    return EffectTrace(
        **texts,
        joints=_names(own, "joints"),
        runs=_names(own, "runs"),
        rows=rows,
        period=None if np.isnan(period) else period,
        part=checked.array(own["part"], t.shape),
        t=t,
        **arrays,
    )


def _write_arrays(group: Any, arrays: Mapping[str, Array]) -> None:
    for name, array in arrays.items():
        _write(group, name, np.asarray(array, dtype=np.float32))


def _write(group: Any, name: str, data: Any) -> None:
    packed = {"compression": "gzip", "shuffle": True} if data.size else {}
    group.create_dataset(name, data=data, **packed)


def _names(group: Any, name: str) -> tuple[str, ...]:
    return tuple(checked.record(group.attrs[name], tuple[str, ...]))
