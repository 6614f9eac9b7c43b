"""Distances of meshes that always lie near each other, tabulated over the two joints between them.

The capsules of links a joint or two apart may overlap whatever the posture (a wrist's sensor and
the forearm), so capsules cannot keep their meshes apart. But their distance depends on those
joints only: it is computed once over a grid of both and interpolated by a cubic spline, which has
a gradient everywhere and costs next to nothing. Where meshes touch, coal gives no depth; there the
table goes on with minus a slope times the way in joint space to the nearest posture that is clear,
so that the gradient leads out. Distances are cut off at `FAR`.
"""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.errors import ConfigError
from excite_cli.geometry.capsules import geometry_key
from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.geometry.link_meshes import LinkMesh, Poses, link_meshes
from excite_cli.geometry.link_shapes import collision_model
from excite_cli.geometry.mesh_pairs import (
    PairMeshes,
    PairTable,
    hull_bounds,
    joined_links,
    movable_pairs,
)
from excite_cli.geometry.reasons import NEVER
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import MovedBodies
from excite_cli.robot.model import Robot

FAR = 0.02  # [m]
_GRIDS = ((0.06, 49), (0.03, 97))  # [rad or m] between nodes; most nodes of one joint
_FINE = 0.0005  # [m] an error that asks for no finer grid
_BEYOND = 2  # nodes beyond the limits, where an optimiser may stray
_LEAST_SLOPE = 0.02  # [m/rad]
_TRIALS = 400
_VERSION = 4  # raise when the tables change
_COARSE = 2  # nodes from one to the next of a first look,
_DOUBT = 0.012  # [m] and what a distance may fall by between them


Tables = dict[tuple[str, str], PairTable | None]


def mesh_tables(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: CollisionPairs,
    ignore: tuple[tuple[str, str], ...] = (),
    kept: float = 0.002,
) -> tuple[PairTable, ...]:
    """Tables of all pairs of links that no checked capsules keep apart and that can come near.

    Near is nearer than `kept` [m]. Left out are links more than two joints apart, links whose
    capsule is given by hand, and pairs that are nearer than `kept` at the posture already (their
    meshes cannot be told apart from contact there).
    """
    key = _key(robot, kept)
    asked = _asked(key, robot, capsules, pairs, ignore)
    last = stored_arrays(asked)
    if last is not None:
        return tuple(table for table in _known(last).values() if table is not None)
    known = _known(stored_arrays(key))
    found, computed = [], False
    for both, joints in _neighbours(robot, capsules, pairs, ignore):
        if _distances(robot, both, PairMeshes(*both), robot.posture[None])[0] <= kept:
            continue
        pair = (both[0].link, both[1].link)
        if pair not in known:
            known[pair], computed = _table(robot, both, joints, kept), True
        table = known[pair]
        if table is not None:
            found.append(table)
    if computed:
        store_arrays(key, _as_arrays(known))
    store_arrays(asked, _as_arrays({(table.first, table.second): table for table in found}))
    return tuple(found)


def near_at_posture(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: CollisionPairs,
    ignore: tuple[tuple[str, str], ...] = (),
    kept: float = 0.002,
) -> tuple[tuple[str, str], ...]:
    """Pairs of links that nothing keeps apart: nearer than `kept` [m] at the posture, not touching.

    `mesh_tables` leaves them out, and the check of the meshes judges them all the same.
    """
    found = []
    for both, _ in _neighbours(robot, capsules, pairs, ignore):
        if 0.0 < _distances(robot, both, PairMeshes(*both), robot.posture[None])[0] <= kept:
            found.append((both[0].link, both[1].link))
    return tuple(found)


def _neighbours(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: CollisionPairs,
    ignore: tuple[tuple[str, str], ...],
) -> Iterator[tuple[tuple[LinkMesh, LinkMesh], Indices]]:
    """Links at most two joints apart that no capsules guard, and the joints between them."""
    meshes = link_meshes(robot)
    guarded = _guarded(capsules, pairs)
    by_hand = {link for capsule in capsules if capsule.by_hand for link in capsule.links}
    moved = MovedBodies(robot)
    for i, j in movable_pairs(robot, meshes, ignore):
        both = (meshes[i], meshes[j])
        names = {both[0].link, both[1].link}
        joints = moved.between(both[0].joint, both[1].joint)
        if len(joints) <= 2 and frozenset(names) not in guarded and not names & by_hand:
            yield both, joints


def require_tabled(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: tuple[tuple[str, str], ...],
    kept: float = 0.002,
) -> None:
    """See that `mesh_tables` guards pairs of links that are to be kept apart by their meshes.

    Raises
    ------
    ConfigError
        A pair has no meshes or a capsule given by hand, is joined directly or more than two joints
        apart, or nearer than `kept` [m] at the posture, so that no table can tell it from contact.
    """
    if not pairs:
        return
    meshes = {mesh.link: mesh for mesh in link_meshes(robot)}
    by_hand = {link for capsule in capsules if capsule.by_hand for link in capsule.links}
    moved = MovedBodies(robot)
    for pair in pairs:
        where = f"constraints.self_collision.by_meshes: {pair[0]} – {pair[1]}"
        if not set(pair) <= set(meshes) or set(pair) & by_hand:
            raise ConfigError(
                f"{where}: both links need collision geometry, and no capsule given by hand."
            )
        if frozenset(pair) in joined_links(robot):
            raise ConfigError(f"{where}: a joint connects both links, so their contact is allowed.")
        one, two = meshes[pair[0]], meshes[pair[1]]
        joints = len(moved.between(one.joint, two.joint))
        if joints == 0:  # they stand still towards each other
            continue
        if joints > 2 or robot.n < 2:
            raise ConfigError(
                f"{where}: {joints} moved joints are between them; tables of meshes are for one or "
                "two. Leave the pair out, so that excite checks their capsules."
            )
        both = (one, two)
        if _distances(robot, both, PairMeshes(*both), robot.posture[None])[0] <= kept:
            raise ConfigError(
                f"{where}: their meshes are nearer than {kept:g} m at robot.posture. Give a "
                "posture at which the meshes are separated."
            )


def _key(robot: Robot, kept: float) -> str:
    """Hash of all that decides the table of any pair; the posture of the others does not."""
    geometry = geometry_key(robot, collision_model(robot))
    digest = hashlib.sha256(f"{_VERSION}|{geometry}|{robot.fingerprint()}|{kept}".encode())
    for part in robot.limits.ranges():
        digest.update(part.tobytes())
    return digest.hexdigest()


def _asked(
    key: str,
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: CollisionPairs,
    ignore: tuple[tuple[str, str], ...],
) -> str:
    """Hash of all that decides which pairs have a table: what capsules guard, and the posture."""
    given = [(capsule.name, capsule.links, capsule.by_hand) for capsule in capsules]
    digest = hashlib.sha256(f"{key}|{given}|{pairs}|{ignore}".encode())
    digest.update(robot.posture.tobytes())
    return digest.hexdigest()


def _as_arrays(tables: Mapping[tuple[str, str], PairTable | None]) -> dict[str, Array]:
    found: dict[str, Array] = {
        "names": np.array([f"{first}|{second}" for first, second in tables]),
        "guarded": np.array([table is not None for table in tables.values()]),
    }
    for k, table in enumerate(tables.values()):
        if table is None:
            continue
        found[f"values_{k}"] = table.values
        found[f"one_{k}"], found[f"two_{k}"] = table.grids
        found[f"facts_{k}"] = np.array(
            [*table.joints, table.error, table.touching, *table.turning], dtype=float
        )
    return found


def _known(arrays: dict[str, Array] | None) -> Tables:
    """Pairs of links that were looked at, with their tables; None: nothing to be guarded."""
    tables: Tables = {}
    if arrays is None:
        return tables
    for k, names in enumerate(arrays["names"].tolist()):
        first, second = str(names).split("|")
        if not arrays["guarded"][k]:
            tables[first, second] = None
            continue
        one, two, error, touching, *turning = arrays[f"facts_{k}"].tolist()
        tables[first, second] = PairTable(
            first,
            second,
            (int(one), int(two)),
            (arrays[f"one_{k}"], arrays[f"two_{k}"]),
            arrays[f"values_{k}"],
            error,
            touching,
            (bool(turning[0]), bool(turning[1])),
        )
    return tables


def _guarded(capsules: tuple[Capsule, ...], pairs: CollisionPairs) -> set[frozenset[str]]:
    """Pairs of links with all capsules of both checked against each other."""
    of: dict[str, set[int]] = {}
    for index, capsule in enumerate(capsules):
        for link in capsule.links:
            of.setdefault(link, set()).add(index)
    checked = {frozenset(pair) for pair in pairs.checked}
    never = {frozenset((d.first, d.second)) for d in pairs.dropped if d.reason.why in NEVER}
    names = {index: capsule.name for index, capsule in enumerate(capsules)}
    return {
        frozenset((one, two))
        for one in of
        for two in of
        if one < two
        and all(
            frozenset((a, b)) in checked or frozenset((names[a], names[b])) in never
            for a in of[one]
            for b in of[two]
        )
    }


def _table(
    robot: Robot, both: tuple[LinkMesh, LinkMesh], joints: Indices, kept: float
) -> PairTable | None:
    """The table of one pair, or None where nothing is to be guarded.

    Nodes are as far apart as the distances allow: the grid is refined where trials between nodes
    say that it is too coarse.
    """
    if robot.n == 1:
        return None  # a table wants two axes; such a pair is left to the check of the meshes
    meshes = PairMeshes(*both)
    alone = len(joints) == 1
    if alone:  # the other axis of the table is any other joint, which changes nothing
        joints = np.append(joints, [k for k in range(robot.n) if k != joints[0]][:1])
    table = None
    for step, most in _GRIDS:
        grids = _grids(robot, joints, alone, step, most)
        across = grids[1][:1] if alone else grids[1]
        doubt = kept + _DOUBT
        first_look = (grids[0][::_COARSE], across[::_COARSE])
        seen = _distances(robot, both, meshes, _nodes(robot, joints, *first_look), doubt)
        if seen.min() >= doubt:
            return None
        values = _distances(robot, both, meshes, _nodes(robot, joints, grids[0], across))
        if values.min() > (kept if (step, most) == _GRIDS[-1] else kept + _DOUBT / _COARSE):
            return None
        values = np.broadcast_to(values.reshape(len(grids[0]), -1), tuple(map(len, grids)))
        table = _tried(robot, both, meshes, _of_values(robot, both, joints, grids, values))
        if table.error <= _FINE and values.min() <= kept:
            break
    return table


def _grids(
    robot: Robot, joints: Indices, alone: bool, step: float, most: int
) -> tuple[Array, Array]:
    """Nodes of both joints; of one that changes nothing four are enough."""
    lower, upper = robot.limits.ranges()
    first, second = (_grid(float(lower[k]), float(upper[k]), step, most) for k in joints)
    if alone:
        second = np.linspace(float(lower[joints[1]]), float(upper[joints[1]]), 4)
    return first, second


def _of_values(
    robot: Robot,
    both: tuple[LinkMesh, LinkMesh],
    joints: Indices,
    grids: tuple[Array, Array],
    values: Array,
) -> PairTable:
    """A table of distances at the nodes, gone on with where the meshes touch; not tried yet."""
    from scipy.ndimage import distance_transform_edt  # tables are stored

    steps = [float(grid[1] - grid[0]) for grid in grids]
    slope = max(_LEAST_SLOPE, float(np.quantile(np.abs(np.gradient(values, *steps)), 0.95)))
    inside = values <= 0.0
    depth = distance_transform_edt(inside, sampling=steps)
    return PairTable(
        both[0].link,
        both[1].link,
        (int(joints[0]), int(joints[1])),
        grids,
        np.where(inside, -slope * depth, values),
        error=0.0,
        touching=float(inside.mean()),
        turning=(_turns(robot, int(joints[0])), _turns(robot, int(joints[1]))),
    )


def _tried(
    robot: Robot, both: tuple[LinkMesh, LinkMesh], meshes: PairMeshes, table: PairTable
) -> PairTable:
    """The table with its error: the most by which it exceeds the true distance at trials."""
    joints = np.array(table.joints)
    lower, upper = (bounds[joints] for bounds in robot.limits.ranges())
    trials = _trials(table, lower, upper)
    q = np.tile(robot.posture, (len(trials), 1))
    q[:, joints] = trials
    true = _distances(robot, both, meshes, q)
    over = table.distances(q) - np.maximum(true, 0.0)
    return replace(table, error=float(np.max(over[true < FAR / 2], initial=0.0)))


def _turns(robot: Robot, joint: int) -> bool:
    """Whether a moved joint turns without end."""
    limits = robot.limits
    return not (robot.sliding[joint] or np.isfinite(limits.lower[joint]))


def _trials(table: PairTable, low: Array, high: Array) -> Array:
    """Positions (K, 2) between nodes: anywhere, and in cells where meshes come near or touch."""
    rng = np.random.default_rng(0)
    anywhere = low + rng.uniform(size=(_TRIALS, 2)) * (high - low)
    v = table.values
    corners = np.stack([v[:-1, :-1], v[1:, :-1], v[:-1, 1:], v[1:, 1:]])
    near = np.argwhere((corners.min(axis=0) < FAR / 4) & (corners.max(axis=0) > 0.0))
    chosen = near[rng.permutation(len(near))[:_TRIALS]]
    steps = np.array([grid[1] - grid[0] for grid in table.grids])
    first = np.array([grid[0] for grid in table.grids])
    middles = first + (chosen + 0.5) * steps
    return np.clip(np.vstack([anywhere, middles]), low, high)


def _grid(low: float, high: float, step: float, most: int) -> Array:
    count = int(np.clip(np.ceil((high - low) / step) + 1, 8, most))
    own = (high - low) / (count - 1)
    return np.asarray(low + own * np.arange(-_BEYOND, count + _BEYOND), dtype=float)


def _nodes(robot: Robot, joints: Indices, one: Array, two: Array) -> Array:
    q = np.tile(robot.posture, (len(one) * len(two), 1))
    q[:, joints[0]], q[:, joints[1]] = np.repeat(one, len(two)), np.tile(two, len(one))
    return q


def _distances(
    robot: Robot,
    both: tuple[LinkMesh, LinkMesh],
    meshes: PairMeshes,
    q: Array,
    far: float = FAR,
) -> Array:
    """Distances (T,) [m], cut off at `far`."""
    poses = Poses.of(robot, q)
    values = np.full(len(poses), far)
    bounds = hull_bounds(poses, both, np.arange(len(poses)), values)
    for t in np.flatnonzero(bounds <= far).tolist():
        # Whether meshes touch is known much sooner than that their distance is 0.
        values[t] = 0.0 if meshes.touch(poses, t) else meshes.distance(poses, t, below=far)
    return values
