"""How near the URDF its inertias are kept: as near as data left out are predicted best.

The prior φ ~ N(φ_URDF, (s · scale)²) (`identification.prior`) with s one of a few shares. For each,
the declared model with the textbook's effects is fitted to blocks of all runs in turn and judged on
the others. Where motions determine the inertias, s hardly matters; where they are silent, the URDF
speaks. URDFs of real arms are off by some 30 %, and no prior is narrower.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.declared_model import KeptInertias, Model
from excite_cli.diagnosis.evidence import Evidence
from excite_cli.diagnosis.noise_model import NoiseModel
from excite_cli.diagnosis.training import TrainingData
from excite_cli.robot.model import Array

SHARES = (0.3, 1.0, 3.0, 10.0, 100.0)


def best_share(data: TrainingData, candidates: Sequence[Candidate], levels: Array) -> float:
    """The share of `SHARES` with the least error on blocks left out.

    `data` are of a model whose prior has the share 1, `levels` (n,) [N·m] the noise.
    """
    whole = data.evidence(candidates, NoiseModel.white(levels))
    assert data.prior is not None
    assert data.weighed is not None
    own = data.prior - data.weighed
    errors = []
    for share in SHARES:
        prior = own / share**2 + data.weighed
        parts = whole.grams, whole.fixed, whole.blocks, whole.rows_of
        energies = Evidence(*parts, prior, data.weighed).in_turn.energies(range(len(candidates)))
        errors.append(float(np.mean(np.log(energies.sum(axis=1) + 1e-300))))
    return SHARES[int(np.argmin(errors))]


def with_share(model: Model, share: float) -> Model:
    """The model with its prior, of share 1, made so wide."""
    assert model.prior is not None
    kept = KeptInertias(model.prior.mean, model.prior.precision / share**2)
    return replace(model, prior=kept)
