"""Where an effect is: what two effects that differ in their shape only have in common."""

from typing import NamedTuple


class Place(NamedTuple):
    """Kind, joints, runs (empty: all) and the column of the log that is followed, if any."""

    kind: str
    joints: tuple[int, ...]
    runs: tuple[str, ...] = ()
    covariate: str = ""
