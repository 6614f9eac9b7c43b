"""What is left of every joint beside its noise: nothing large stays without a word.

More than noise is left where the residual exceeds `_TIMES` the noise, or where a good part of it
can be predicted. Noise is what changes between repeated periods, if there are any, or what the
torque's own spectrum above the motion says.
"""

from collections.abc import Sequence

import numpy as np

from excite_cli.diagnosis.high_band import band_noise
from excite_cli.diagnosis.records import LargeRest
from excite_cli.diagnosis.structure import Quantities, Structure
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Signals
from excite_cli.identification.noise_floor import NoiseFloor
from excite_cli.identification.processing import Processing
from excite_cli.measurement.dataset import Run
from excite_cli.robot.model import Array

# 42 simulated robots without any defect stay below 1.42, and none of those above 2.5 is without.
_TIMES = 2.5
_PREDICTABLE = 0.3  # share; of noise with a memory hardly anything is
_SAID = 0.2  # a quantity that predicts less is no answer
_UNKNOWN = 0.02  # of the torque's RMS: a word where noise is not known
_SMALLEST = 2e-3  # of the torque's RMS: what is smaller needs no word


def large_rests(
    data: TrainingData,
    signals: Sequence[Signals],
    residuals: Sequence[Array],
    recorded: Sequence[Run],
    processing: Processing,
    repeated: NoiseFloor | None,
    joint_names: Sequence[str],
) -> tuple[LargeRest, ...]:
    """Joints of whose torque more is left than noise, by `residuals` (M, n) of the training parts.

    recorded: the training parts as they were read; repeated: the floor from repeated periods.
    """
    quantities = Quantities(data, signals, joint_names)
    band = band_noise(recorded, data.runs, processing)
    found = []
    for joint, name in enumerate(joint_names):
        rms, torque = (
            _rms([x[run.usable[:, joint], joint] for x, run in zip(series, data.runs, strict=True)])
            for series in (residuals, [run.tau_fit for run in data.runs])
        )
        if not rms > _SMALLEST * torque:
            continue
        noise, most = float(band.white[joint]), float(band.coloured[joint])
        basis = "band"
        if repeated is not None and np.isfinite(repeated.rms[joint]):
            noise = most = float(repeated.rms[joint])
            basis = "periods"
        known = np.isfinite(noise)
        above = rms > _TIMES * noise if known else rms > _UNKNOWN * torque
        rest = quantities.rest(joint, residuals)
        predictable = rest is not None and rest.predictable > _PREDICTABLE
        if not above and not predictable:
            continue
        structure = Structure(0.0) if rest is None else rest.structure()
        certain = rms > _TIMES * most or structure.predictable > _PREDICTABLE
        found.append(
            LargeRest(
                joint=name,
                rms=rms,
                share_of_torque=rms / torque,
                noise=noise if known else None,
                basis=basis if known else "",
                certain=certain,
                predictable=structure.predictable,
                depends_on=structure.depends_on if structure.named > _SAID else (),
            )
        )
    return tuple(found)


def _rms(parts: Sequence[Array]) -> float:
    every = np.concatenate(parts)
    return float(np.sqrt(np.mean(every**2))) if len(every) else float("nan")
