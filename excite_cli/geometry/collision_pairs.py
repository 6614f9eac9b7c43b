"""Which pairs of capsules are worth checking, and why the others are not.

A pair is dropped when no motion can part or join it. Whether two bodies ever meet is judged over a
large random sample of the position limits, and, where the sample stays clear, by descending from
its nearest postures towards contact; that is a search, not a proof, so a safe allowance is added.
Neighbours but one (the base and the upper arm of an industrial robot) pass each other closer than
capsules can tell: where their capsules touch, the meshes themselves decide whether they ever meet.
"""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations, product
from typing import Any

import coal
import numpy as np

from excite_cli.arrays import Array, Indices
from excite_cli.config.constraints_spec import SelfCollisionSpec
from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.errors import RobotError
from excite_cli.geometry.capsules import geometry_key
from excite_cli.geometry.link_shapes import collision_model
from excite_cli.geometry.mesh_distances import MeshDistances
from excite_cli.geometry.mesh_pairs import joined_links
from excite_cli.geometry.pair_distances import PairDistances
from excite_cli.geometry.reasons import NEVER, DroppedPair, LinksApart, Reason, Why
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.link_frame import MovedBodies
from excite_cli.robot.model import Robot

# Why pairs of capsules are dropped, on disk: what takes seconds is found once for a robot.
#
# A file that is missing, damaged or foreign is the same as none; a folder that cannot be written is
# no error.

_VERSION = 3  # raise when the choice changes
_REASONS = "reasons"


def choice_key(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: list[tuple[int, int]],
    margin: float,
    samples: int,
    seed: int,
) -> str | None:
    """Hash of all that decides the choice; None where the meshes cannot be read."""
    try:
        geometry = geometry_key(robot, collision_model(robot))
    except RobotError:
        return None
    asked = (geometry, robot.fingerprint(), pairs, margin, samples, seed, coal.__version__)
    digest = hashlib.sha256(f"{_VERSION}|{asked}".encode())
    for part in (*robot.limits.ranges(), robot.posture):
        digest.update(part.tobytes())
    for capsule in capsules:
        named = (capsule.name, capsule.joint, capsule.links, capsule.by_hand, capsule.radius)
        digest.update(f"|{named}".encode())
        digest.update(capsule.start.tobytes() + capsule.end.tobytes())
    return digest.hexdigest()


def stored_reasons(key: str | None, count: int) -> list[Reason | None] | None:
    """The reasons of `count` pairs stored under `key`, None where a pair is kept; or None."""
    found = stored_arrays(key) if key is not None else None
    if found is None or _REASONS not in found:
        return None
    reasons = found[_REASONS]
    if reasons.shape != (count,) or reasons.dtype.kind != "U":
        return None
    try:
        return [_reason(json.loads(str(text))) for text in reasons]
    except (ValueError, TypeError, KeyError):  # no reasons of ours
        return None


def store_reasons(key: str | None, reasons: Sequence[Reason | None]) -> None:
    """Keep `reasons` under `key`."""
    if key is not None:
        texts = [json.dumps(None if reason is None else asdict(reason)) for reason in reasons]
        store_arrays(key, {_REASONS: np.array(texts, dtype=np.str_)})


def _reason(data: dict[str, Any] | None) -> Reason | None:
    if data is None:
        return None
    distance, apart = data["distance"], tuple(LinksApart(**each) for each in data["apart"])
    return Reason(Why(data["why"]), None if distance is None else float(distance), apart)


_ALWAYS = 0.99  # share of the sample in contact
_CONTACT_SAMPLES = 200
_CONTACT = 0.01  # [m] a wider margin does not make a contact; it may make the problem infeasible
_ALLOWANCE = 0.05  # [m] beyond the margin that the nearest posture found must keep
_STARTS = 3
_STEPS = 30
_BLOCK = 500
_DOUBTFUL = 0.02  # share of the sample in contact above which the meshes are asked
_FEW_JOINTS = 3
_MESH_SAMPLES = 200


@dataclass(frozen=True)
class CollisionPairs:
    """Pairs of capsules to check, as indices into the capsules, and the pairs left out."""

    checked: tuple[tuple[int, int], ...]
    dropped: tuple[DroppedPair, ...]


def choose_pairs(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    spec: SelfCollisionSpec,
    samples: int = 2000,
    seed: int = 0,
    bounded: bool = True,
) -> CollisionPairs:
    """Pairs that can be apart and can come near, in order of the capsules.

    Dropped are pairs on the same body, of links joined by one moved joint, ignored in `spec`,
    nearer than the margin in at least 99 % of `samples` random postures within the limits, and
    never nearer than the margin and 5 cm in the sample or at the end of a descent from it. So are
    capsules that touch although the meshes, at most three joints apart, never come as near as the
    margin. What never comes near within the limits is kept unless positions are `bounded` by a
    constraint.
    """
    dropped: dict[tuple[int, int], Reason] = {}
    possible: list[tuple[int, int]] = []
    known = _Known(robot, spec)
    for pair in combinations(range(len(capsules)), 2):
        reason = known.reason(capsules[pair[0]], capsules[pair[1]])
        if reason:
            dropped[pair] = reason
        else:
            possible.append(pair)
    if possible:
        asked = (robot, capsules, possible, spec.margin, samples, seed)
        key = choice_key(*asked)
        reasons = stored_reasons(key, len(possible))
        if reasons is None:
            reasons = _by_sampling(*asked)
            store_reasons(key, reasons)
        for pair, reason in zip(possible, reasons, strict=True):
            if reason and (bounded or reason.why not in NEVER):
                dropped[pair] = reason
    return CollisionPairs(
        checked=tuple(pair for pair in possible if pair not in dropped),
        dropped=tuple(
            DroppedPair(capsules[pair[0]].name, capsules[pair[1]].name, dropped[pair])
            for pair in sorted(dropped)
        ),
    )


class _Known:
    """What the structure of the robot and the config say about a pair."""

    def __init__(self, robot: Robot, spec: SelfCollisionSpec) -> None:
        self._moved = MovedBodies(robot)
        self._neighbours = joined_links(robot)
        self._ignored = {frozenset(pair) for pair in spec.ignore}
        self._by_meshes = {frozenset(pair) for pair in spec.by_meshes}

    def reason(self, first: Capsule, second: Capsule) -> Reason | None:
        between = len(self._moved.between(first.joint, second.joint))
        links = {frozenset((one, two)) for one in first.links for two in second.links}
        if between == 0:
            return Reason(Why.SAME_BODY)
        if links & self._ignored:
            return Reason(Why.IGNORED)
        if links & self._by_meshes:
            return Reason(Why.BY_MESHES)
        if between == 1 and links & self._neighbours:
            return Reason(Why.ADJACENT)
        return None


def _by_sampling(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    pairs: list[tuple[int, int]],
    margin: float,
    samples: int,
    seed: int,
) -> list[Reason | None]:
    """Why each pair is dropped; None where it is kept."""
    measure = PairDistances(robot, capsules, pairs)
    q, _, _ = robot.draw_states(samples, seed)
    distances = np.vstack([measure.distances(q[k : k + _BLOCK]) for k in range(0, len(q), _BLOCK)])
    touching = (distances < margin).mean(axis=0)
    always = (distances < min(margin, _CONTACT)).mean(axis=0) >= _ALWAYS
    nearest = distances.min(axis=0)
    clear = np.flatnonzero(nearest > margin + _ALLOWANCE)
    if len(clear):
        starts = np.argsort(distances[:, clear], axis=0)[:_STARTS]
        target = margin + _ALLOWANCE
        nearest[clear] = _descend(robot, measure, q[starts], clear, target)
    reasons: list[Reason | None] = [None] * len(pairs)
    for k in np.flatnonzero(nearest > margin + _ALLOWANCE).tolist():
        reasons[k] = Reason(Why.NEVER_NEAR, float(nearest[k]))
    start = measure.distances(robot.posture[None])[0]
    doubtful = ~always & (nearest <= margin + _ALLOWANCE)
    doubtful &= (touching > _DOUBTFUL) | (start < 2 * margin)
    wanted = {k: pairs[k] for k in np.flatnonzero(doubtful).tolist()}
    for k, reason in _by_meshes(robot, capsules, wanted, (q, distances), margin):
        reasons[k] = reason
    touch = {k: pairs[k] for k in np.flatnonzero(always).tolist()}
    for k, reason in _contacts(robot, capsules, touch, q):
        reasons[k] = replace(reason, distance=float(-distances[:, k].min()))
    return reasons


def _by_meshes(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    doubtful: dict[int, tuple[int, int]],
    sample: tuple[Array, Array],
    margin: float,
) -> Iterator[tuple[int, Reason]]:
    """Those of the doubtful pairs, few joints apart, whose meshes never come near the margin.

    doubtful: pair of capsules by column of the sample, which is positions and their distances.
    """
    between = MovedBodies(robot)
    meshes: MeshDistances | None = None
    known: dict[tuple[tuple[str, ...], tuple[str, ...]], float] = {}
    q, distances = sample
    for k, pair in doubtful.items():
        first, second = (capsules[index] for index in pair)
        moved = between.between(first.joint, second.joint)
        if len(moved) > _FEW_JOINTS:
            continue
        meshes = meshes or MeshDistances(robot)
        if first.by_hand or second.by_hand or not meshes.knows(first.links + second.links):
            continue
        links = (first.links, second.links)
        if links not in known:
            starts = np.vstack([robot.posture, q[np.argsort(distances[:, k])[:_MESH_SAMPLES]]])
            known[links] = meshes.least_distance(*links, starts, moved, stop=margin)
        if known[links] > margin:
            yield k, Reason(Why.MESHES_NEVER_NEAR, known[links])


def _contacts(
    robot: Robot,
    capsules: tuple[Capsule, ...],
    always: dict[int, tuple[int, int]],
    q: Array,
) -> Iterator[tuple[int, Reason]]:
    """Why each pair of capsules that overlap at all times is not checked.

    No motion can part the capsules, so nothing can be asked of them. Where the meshes do part at
    times, the pair is reported as unguarded, so that somebody checks it.
    """
    meshes: MeshDistances | None = None
    known: dict[tuple[str, str], float] = {}
    some = q[:: max(1, len(q) // _CONTACT_SAMPLES)]
    for k, pair in always.items():
        first, second = (capsules[index] for index in pair)
        meshes = meshes or MeshDistances(robot)
        if first.by_hand or second.by_hand or not meshes.knows(first.links + second.links):
            yield k, Reason(Why.ALWAYS_TOUCHING)
            continue
        apart = {}
        # Link by link: one that always touches must not excuse another in the same capsule.
        for links in product(first.links, second.links):
            if links not in known:
                one, other = links
                touching = [meshes.touch([one], [other], at) for at in some]
                known[links] = 1.0 - float(np.mean(touching))
            apart[links] = known[links]
        loose = tuple(
            LinksApart(*names, share) for names, share in apart.items() if share > 1 - _ALWAYS
        )
        yield k, Reason(Why.UNGUARDED, apart=loose) if loose else Reason(Why.ALWAYS_TOUCHING)


def _descend(
    robot: Robot, measure: PairDistances, starts: Array, pairs: Indices, target: float
) -> Array:
    """Least distance (K,) [m] found for each pair on the way from its `starts` (S, K, n).

    Steps go along the gradient to where the linearised distance is just below the target, at most
    0.3 rad (or 0.3 m) far, shorter with time, and are kept within the limits.
    """
    lower, upper = robot.limits.ranges()
    least = np.full(len(pairs), np.inf)
    for q in starts:
        going = np.arange(len(pairs))
        for step in range(_STEPS + 1):
            rows = np.arange(len(going))
            distance = measure.distances_at(q, rows, pairs[going])
            least[going] = np.minimum(least[going], distance)
            keep = least[going] > target
            if step == _STEPS or not keep.any():
                break
            slope = measure.gradients(q, rows, pairs[going])[keep]
            going, q, excess = going[keep], q[keep], distance[keep] - target + 0.01
            slope = np.where((q <= lower) & (slope > 0) | (q >= upper) & (slope < 0), 0.0, slope)
            move = -slope * (excess / np.maximum((slope**2).sum(axis=1), 1e-6))[:, None]
            reach = 0.3 * 0.93**step
            move *= np.minimum(1.0, reach / np.maximum(np.abs(move).max(axis=1), 1e-12))[:, None]
            q = np.clip(q + move, lower, upper)
    return least
