"""What is left of every joint beside its noise: nothing large stays without a word.

More than noise is left where the residual exceeds `_TIMES` the noise, or where a good part of it
can be predicted. Noise is what changes between repeated periods, if there are any, or what the
torque's own spectrum above the motion says. What is left in samples that no fit counts, around
reversals, is told apart: friction there is what the torque says, and no name is at fault.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.noise_spectrum import band_noise
from excite_cli.diagnosis.records import ExcessResidual
from excite_cli.diagnosis.residual_predictability import Quantities, Structure
from excite_cli.diagnosis.search_result import SearchResult
from excite_cli.diagnosis.traces import Dependence
from excite_cli.identification.noise_floor import NoiseFloor
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Mask, Run
from excite_cli.robot.model import Array

# 42 simulated robots without any defect stay below 1.42, and none of those above 2.5 is without.
_TIMES = 2.5
_PERHAPS = 1.6  # a word, that noise with a memory may be as large
_PREDICTABLE = 0.3  # share; of noise with a memory hardly anything is
# A quantity that predicts less is no answer. On four joints of a simulated UR10 that had noise
# alone none predicted more than 0.04; where friction of another joint's speed was hidden in the
# noise that speed predicted 0.29, all quantities together 0.13.
_SAID = 0.2
_UNKNOWN = 0.003  # of the torque's RMS: a word where noise is not known
_SMALLEST = 1e-3  # of the torque's RMS: what is smaller needs no word


def excess_residuals(
    traced: SearchResult,
    predicted: Sequence[Array],
    residuals: Sequence[Array],
    recorded: Sequence[Run],
    processing: Processing,
    repeated: NoiseFloor | None,
) -> tuple[tuple[ExcessResidual, ...], Dependence]:
    """Joints of whose torque more is left than noise in the training parts; on what it depends.

    predicted: torque (T, n) of the model at the working rate; residuals: (M, n) of what fits count;
    recorded: the parts as they were read; repeated: the floor from repeated periods.
    """
    data, joint_names = traced.data, traced.model.robot.joint_names
    quantities = Quantities(data, traced.signals, joint_names)
    band = band_noise(recorded, data.runs, predicted, processing)
    usable = np.concatenate([run.usable for run in data.runs])
    valid = np.concatenate([run.valid for run in data.runs])
    left = [
        run.tau - run.averaged_torque(each) for run, each in zip(data.runs, predicted, strict=True)
    ]
    fitted = _rms(residuals, usable)
    torques = _rms([run.tau_fit for run in data.runs], usable)
    in_motion = _rms(left, usable & valid)
    found = []
    shares = np.zeros((len(joint_names), len(quantities.names)))
    for joint, name in enumerate(joint_names):
        rms, torque, around = fitted[joint], torques[joint], in_motion[joint]
        if not max(rms, around) > _SMALLEST * torque:
            continue
        noise, most, basis = float(band.white[joint]), float(band.coloured[joint]), "band"
        if repeated is not None and np.isfinite(repeated.rms[joint]):
            noise = most = float(repeated.rms[joint])
            basis = "periods"
        known = np.isfinite(noise)
        enough = _PERHAPS * noise if known else _UNKNOWN * torque
        rest = quantities.rest(joint, residuals)
        if rest is not None and rest.predictable > 0.0:
            shares[joint] = np.clip(list(rest.shares.values()), 0.0, 1.0)
        by_all = rest is not None and rest.predictable > _PREDICTABLE
        predictable = by_all or bool(shares[joint].max() > _SAID)
        if not max(rms, around) > enough and not predictable:
            continue
        at_reversals = not rms > enough and not predictable
        structure = Structure(0.0) if rest is None or at_reversals else rest.structure()
        size = around if at_reversals else rms
        found.append(
            ExcessResidual(
                joint=name,
                rms=size,
                share_of_torque=size / torque,
                noise=noise if known else None,
                basis=basis if known else "",
                certain=predictable or rms > _TIMES * most or structure.predictable > _PREDICTABLE,
                predictable=structure.predictable,
                depends_on=structure.depends_on if structure.named > _SAID else (),
                at_reversals=at_reversals,
            )
        )
    return tuple(found), Dependence(tuple(joint_names), quantities.names, shares)


def _rms(parts: Sequence[Array], counted: Mask) -> list[float]:
    """Of every joint over the samples that count; NaN where there are none."""
    columns = zip(np.concatenate(parts).T, counted.T, strict=True)
    return [
        float(np.sqrt(np.mean(np.square(x[at])))) if at.any() else float("nan") for x, at in columns
    ]
