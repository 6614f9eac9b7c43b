"""Own batched capsule distances against one coal call per instant, and their gradients.

Run: python -m benchmarks.clearance
"""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from benchmarks.problems import interleaved, problem
from excite_cli.constraints.self_collision import Clearance, SelfCollision
from excite_cli.geometry.coal_distances import Array, CoalDistances
from excite_cli.geometry.collision_pairs import CollisionPairs

Indices = NDArray[np.intp]


class CoalGradients(CoalDistances):
    """`CoalDistances` with derivatives from its witness points, which are in millimetres."""

    def gradients(self, q: Array, rows: Indices, cols: Indices) -> Array:
        """Derivatives (K, n) of the distance at instant rows[k] of pair cols[k] by q."""
        configurations = self.robot.configurations(np.asarray(q, dtype=float))
        result = np.empty((len(rows), self.robot.n))
        for t in np.unique(rows):
            self.measure(configurations[t])
            pin.computeJointJacobians(self.robot.model, self.data, configurations[t])
            for k in np.flatnonzero(rows == t):
                result[k] = self._gradient(int(cols[k]))
        return result

    def _gradient(self, pair: int) -> Array:
        answer = self.results[pair]
        normal = np.asarray(answer.normal).ravel()
        slopes = []
        for joint, point in zip(
            self.joints[pair], (answer.getNearestPoint1(), answer.getNearestPoint2()), strict=True
        ):
            wrench = np.concatenate([normal, np.cross(np.asarray(point).ravel() / 1000.0, normal)])
            columns = pin.getJointJacobian(
                self.robot.model, self.data, joint, pin.ReferenceFrame.WORLD
            )
            slopes.append(wrench @ columns if joint else np.zeros(self.robot.model.nv))
        return (slopes[1] - slopes[0])[self.robot.moved]


def main() -> None:
    print(
        f"{'400 instants, 40 pairs; 1000 rows':34} {'ours ms':>9} {'coal ms':>9} {'coal/ours':>10}"
    )
    for name in ("talos_arms", "ur10"):
        of = problem(name)
        constraint = next(c for c in of.constraints if isinstance(c, SelfCollision))
        pairs = CollisionPairs(constraint.pairs.checked[:40], ())
        ours = Clearance(of.robot, constraint.capsules, pairs)
        coal = CoalGradients(of.robot, constraint.capsules, pairs.checked)
        q, _, _ = of.robot.draw_states(400, 1)
        rng = np.random.default_rng(0)
        rows = rng.integers(0, 400, 1000)
        cols = rng.integers(0, len(pairs.checked), 1000)
        times = interleaved(
            {
                "distances": lambda ours=ours, q=q: ours.distances(q.copy()),
                "distances coal": lambda coal=coal, q=q: coal.distances(q),
                "gradients": lambda o=ours, q=q, r=rows, c=cols: o.gradients(q, r, c),
                "gradients coal": lambda o=coal, q=q, r=rows, c=cols: o.gradients(q, r, c),
            },
            7,
        )
        for what in ("distances", "gradients"):
            fast, slow = times[what], times[f"{what} coal"]
            label = f"{name}, {what}"
            print(f"{label:34} {1e3 * fast:9.2f} {1e3 * slow:9.2f} {slow / fast:10.1f}")


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
