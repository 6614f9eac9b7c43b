"""Bodies drawn within the words of `uncertainty` never exceed the bound that is kept.

    python -m benchmarks.uncertain_bodies [--bodies 10000] [--seed 1]

Mass m₀(1 ± μ), centre c₀ ± δ, inertia about the centre ± ι (at their ends as often as between), for
UR10, Panda and TALOS' arms with the default words; joint torques at 40 random states. Printed are
the torques of bodies beyond the bound, and how loose it is: slack of the bound over the largest
deviation of the drawn bodies, per joint and state (median, least).
"""

import argparse

import numpy as np

from benchmarks.problems import problem
from excite_cli.config.spec import UncertaintySpec
from excite_cli.constraints.base import Array
from excite_cli.dynamics.regressor import Regressor
from excite_cli.dynamics.uncertain_inertias import inertia_uncertainty
from excite_cli.dynamics.whole_robot import whole_parameters

ROBOTS = ("ur10", "panda", "talos_arms")
_STATES = 40
_PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def drawn_bodies(phi: Array, words: UncertaintySpec, count: int, seed: int) -> Array:
    """Parameters (count, P) of robots whose bodies are within `words` of `phi` (P,)."""
    rng = np.random.default_rng(seed)
    found = []
    for ten in phi.reshape(-1, 10):
        mass, center = ten[0], ten[1:4] / ten[0] if ten[0] else np.zeros(3)
        about = _about_center(ten, center)
        unit = _ends(rng, (count, 10))
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


def _about_center(ten: Array, center: Array) -> Array:
    about = np.zeros((3, 3))
    for value, (i, j) in zip(ten[4:], _PAIRS, strict=True):
        about[i, j] = about[j, i] = value
    return np.asarray(about - ten[0] * (center @ center * np.eye(3) - np.outer(center, center)))


def _ends(rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Values in [−1, 1], half of them at an end."""
    values = rng.uniform(-1.0, 1.0, shape)
    return np.asarray(np.where(rng.uniform(size=shape) < 0.5, np.sign(values), values))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bodies", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    words = UncertaintySpec()
    for name in ROBOTS:
        of = problem(name, "constraints.self_collision=null")
        phi = whole_parameters(of.robot)
        known = inertia_uncertainty(words, of.robot, of.base)
        states = of.robot.draw_states(_STATES, given.seed)
        y = Regressor(of.robot).evaluate(*states)
        rows = np.pad(y.reshape(-1, y.shape[-1]), ((0, 0), (len(phi) - y.shape[-1], 0)))
        torques = drawn_bodies(phi, words, given.bodies, given.seed) @ rows.T
        below, negative = known.least_both(rows)
        beyond = int(((torques < below - 1e-9) | (torques > -negative + 1e-9)).sum())
        middle = rows @ phi
        largest = np.maximum(torques.max(axis=0) - middle, middle - torques.min(axis=0))
        loose = np.maximum(middle - below, -negative - middle) / np.maximum(largest, 1e-12)
        print(
            f"{name}: {given.bodies} robots, {torques.size} torques, {beyond} beyond the bound; "
            f"bound / largest drawn: median {np.median(loose):.2f}, least {loose.min():.2f}"
        )


if __name__ == "__main__":
    main()
