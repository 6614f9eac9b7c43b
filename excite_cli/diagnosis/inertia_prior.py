"""How near the URDF its inertias are kept: as near as data left out are predicted best.

The prior φ ~ N(φ_URDF, (s · scale)²) (`identification.prior`) with s one of a few shares. For each,
the declared model with the textbook's effects predicts training data left out, as in `comparison`.
Where motions determine the inertias, s hardly matters; where they are silent, the URDF
speaks. URDFs of real arms are off by some 30 %, and no prior is narrower.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.comparison import errors_of_new
from excite_cli.diagnosis.declared_model import KeptInertias, Model
from excite_cli.diagnosis.training import TrainingData
from excite_cli.robot.model import Array

SHARES = (0.3, 1.0, 3.0, 10.0, 100.0)


def best_share(data: TrainingData, candidates: Sequence[Candidate], levels: Array) -> float:
    """The share of `SHARES` with the least error on data left out.

    `data` are of a model whose prior has the share 1, `levels` (n,) [N·m] the noise.
    """
    assert data.prior is not None
    assert data.weighed is not None
    own = data.prior - data.weighed
    priors = [own / share**2 + data.weighed for share in SHARES]
    return SHARES[int(np.argmin(errors_of_new(data, candidates, levels, priors)))]


def with_share(model: Model, share: float) -> Model:
    """The model with its prior, of share 1, made so wide."""
    assert model.prior is not None
    kept = KeptInertias(model.prior.mean, model.prior.precision / share**2)
    return replace(model, prior=kept)
