"""Traces as HDF5 groups: arrays compressed in single precision, the rest as attributes."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.traces import Dependence, EffectTrace, Traces
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array

_TORQUE = ("q", "v", "a", "load", "measured", "predicted")
_EFFECT = ("x", "own", "partial")


def write_torque_traces(group: Any, traces: Sequence[TorqueTrace]) -> None:
    """One numbered group for every trace."""
    for number, trace in enumerate(traces):
        own = group.create_group(str(number))
        own.attrs.update({"run": trace.run, "sealed": trace.sealed})
        arrays = {name: getattr(trace, name) for name in ("t", *_TORQUE)}
        if trace.before is not None:
            arrays["before"] = trace.before
        _write_arrays(own, arrays)
        _write(own, "counted", np.asarray(trace.counted, dtype=bool))


def read_torque_traces(group: Any) -> tuple[TorqueTrace, ...]:
    """The traces in their order.

    Raises
    ------
    ValueError
        Arrays do not fit together.
    """
    found = []
    for number in range(len(group)):
        own = group[str(number)]
        t = _array(own["t"])
        arrays: dict[str, Any] = {name: _array(own[name]) for name in _TORQUE}
        before = _array(own["before"]) if "before" in own else None
        counted = np.asarray(own["counted"], dtype=bool)
        every = [*arrays.values(), counted, *([] if before is None else [before])]
        shapes = {x.shape for x in every}
        if len(shapes) != 1 or arrays["q"].shape[:1] != t.shape or arrays["q"].ndim != 2:
            raise ValueError(f"the arrays of {own.name} do not fit together")
        run, sealed = str(own.attrs["run"]), bool(own.attrs["sealed"])
        found.append(
            TorqueTrace(run=run, sealed=sealed, t=t, counted=counted, before=before, **arrays)
        )
    return tuple(found)


def write_traces(group: Any, traces: Traces) -> None:
    """Traces of the training data of a diagnosis."""
    group.attrs["torque_units"] = json.dumps(traces.torque_units)
    write_torque_traces(group.create_group("runs"), traces.runs)
    effects = group.create_group("effects")
    for number, trace in enumerate(traces.effects):
        own = effects.create_group(str(number))
        names = {"joints": trace.joints, "runs": trace.runs, "rows": trace.rows}
        own.attrs.update({name: json.dumps(value) for name, value in names.items()})
        own.attrs.update({"kind": trace.kind, "quantity": trace.quantity, "unit": trace.unit})
        own.attrs["period"] = np.nan if trace.period is None else trace.period
        _write_arrays(own, {name: getattr(trace, name) for name in ("part", "t", *_EFFECT)})
    dependence = group.create_group("dependence")
    dependence.attrs["joints"] = json.dumps(traces.dependence.joints)
    dependence.attrs["quantities"] = json.dumps(
        [each.code for each in traces.dependence.quantities]
    )
    dependence["shares"] = np.asarray(traces.dependence.shares, dtype=float)


def read_traces(group: Any) -> Traces:
    """What `write_traces` wrote.

    Raises
    ------
    ValueError
        Arrays do not fit together.
    """
    effects = group["effects"]
    dependence = group["dependence"]
    joints = _names(dependence, "joints")
    quantities = tuple(Covariate.of_code(code) for code in _names(dependence, "quantities"))
    shares = _array(dependence["shares"])
    if shares.shape != (len(joints), len(quantities)):
        raise ValueError("the map of dependences does not fit its names")
    return Traces(
        torque_units=_names(group, "torque_units"),
        runs=read_torque_traces(group["runs"]),
        effects=tuple(_effect(effects[str(number)]) for number in range(len(effects))),
        dependence=Dependence(joints, quantities, shares),
    )


def _effect(own: Any) -> EffectTrace:
    rows, part, t = _names(own, "rows"), _array(own["part"]), _array(own["t"])
    arrays: dict[str, Any] = {name: _array(own[name]) for name in _EFFECT}
    period = float(own.attrs["period"])
    if {x.shape for x in arrays.values()} != {(len(t), len(rows))} or part.shape != t.shape:
        raise ValueError(f"the arrays of {own.name} do not fit together")
    texts: dict[str, Any] = {n: str(own.attrs[n]) for n in ("kind", "quantity", "unit")}
    return EffectTrace(
        **texts,
        joints=_names(own, "joints"),
        runs=_names(own, "runs"),
        rows=rows,
        period=None if np.isnan(period) else period,
        part=part,
        t=t,
        **arrays,
    )


def _write_arrays(group: Any, arrays: Mapping[str, Array]) -> None:
    for name, array in arrays.items():
        _write(group, name, np.asarray(array, dtype=np.float32))


def _write(group: Any, name: str, data: Any) -> None:
    packed = {"compression": "gzip", "shuffle": True} if data.size else {}
    group.create_dataset(name, data=data, **packed)


def _array(dataset: Any) -> Array:
    return np.asarray(dataset, dtype=float)


def _names(group: Any, name: str) -> tuple[str, ...]:
    return tuple(str(each) for each in json.loads(str(group.attrs[name])))
