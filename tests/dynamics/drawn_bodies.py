"""Robots whose bodies are drawn within the words of `uncertainty`."""

import numpy as np

from excite_cli.config.spec import UncertaintySpec
from excite_cli.constraints.base import Array

_PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def drawn_bodies(phi: Array, words: UncertaintySpec, count: int, seed: int) -> Array:
    """Parameters (count, P) around φ (P,); half of all values are at an end of their interval."""
    rng = np.random.default_rng(seed)
    found = []
    for ten in phi.reshape(-1, 10):
        mass, center = ten[0], ten[1:4] / ten[0] if ten[0] else np.zeros(3)
        about = np.zeros((3, 3))
        for value, (i, j) in zip(ten[4:], _PAIRS, strict=True):
            about[i, j] = about[j, i] = value
        about -= mass * (center @ center * np.eye(3) - np.outer(center, center))
        unit = rng.uniform(-1.0, 1.0, (count, 10))
        unit = np.where(rng.uniform(size=unit.shape) < 0.5, np.sign(unit), unit)
        m = mass * (1.0 + words.mass * unit[:, 0])
        c = center + words.center_of_mass * unit[:, 1:4]
        six = []
        for k, (i, j) in enumerate(_PAIRS):
            reach = words.inertia * (abs(about[i, i]) + abs(about[j, j])) / 2
            parallel = -m * c[:, i] * c[:, j]
            if i == j:
                parallel = m * (np.square(c).sum(axis=1) - c[:, i] ** 2)
            six.append(about[i, j] + reach * unit[:, 4 + k] + parallel)
        found.append(np.column_stack([m, m[:, None] * c, *six]))
    return np.hstack(found)
