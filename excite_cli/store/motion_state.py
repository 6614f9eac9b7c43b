"""Whether a motion in a file is still the one that was proved, by the digest that it was given.

The digest in a file is that of the motion (`excitation/motion_digest.py`) and of its samples in the
file: what a script reads there is part of what must not have changed.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

from excite_cli.excitation.doubt import Doubt
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.motion_digest import digest_of_array
from excite_cli.robot.model import Array


def digest_with_samples(digest: str, samples: Sequence[Array]) -> str:
    """What a file holds of a motion of this `digest`, with its samples t (T,), q, v, a (T, n)."""
    parts = (digest, *map(digest_of_array, samples))
    return hashlib.sha256("|".join(parts).encode()).hexdigest()


def as_found(motion: Motion, digest: str, samples: Sequence[Array], stored: str) -> Motion:
    """The motion of a file, doubted where it is not what it was.

    `digest` is that of what the file holds now, `stored` what the file says; empty: nothing.
    """
    if not stored:
        return motion.doubted(Doubt.EARLIER)
    if stored == digest_with_samples(digest, samples):
        return replace(motion, digest=digest)
    return replace(motion.doubted(Doubt.CHANGED), digest=stored)
