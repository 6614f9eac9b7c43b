"""Whether the parts of a result agree: nothing is handed to a robot that its file does not state.

A result holds its motions twice, as coefficients (with the trajectory of its config) and as
samples. Where one of them was edited, or the joints of the config, nobody knows which is meant.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from excite_cli.config.load_spec import parse_spec
from excite_cli.errors import FileError
from excite_cli.excitation.result import Result
from excite_cli.robot.model import Array
from excite_cli.trajectory.fade import Segment

_SAME = 1e-6  # of the largest value: they differ by rounding only


def require_own_samples(
    file: Path,
    result: Result,
    segments: Sequence[Segment],
    samples: Mapping[int, tuple[Array, Array, Array, Array]],
) -> None:
    """See that the motions of a result are those of its samples and joints.

    `samples`: t (T,), q, v, a (T, n) by the index of a motion.

    Raises
    ------
    FileError
        They are not: someone changed one of them.
    """
    joints = parse_spec(result.config, f"the config stored in {file}").robot.joints
    if joints != "all" and set(joints) != set(result.joint_names):
        raise FileError(
            f"{file} moves {', '.join(result.joint_names)}, but its config names "
            f"{', '.join(joints)}. Someone changed one of them: plan the motions anew."
        )
    by_name = {f"motion_{index}": stored for index, stored in samples.items()}
    for segment in segments:
        t, *stored = by_name[segment.name]
        states = segment.trajectory.states(t, segment.coefficients)
        for name, there, here in zip("qva", stored, states, strict=True):
            off = np.inf if there.shape != here.shape else float(np.abs(there - here).max())
            if not off <= _SAME * float(np.abs(here).max(initial=1.0)):
                raise FileError(
                    f"{file}: the samples {name} of {segment.name} are not those of its "
                    "coefficients and config. Someone changed one of them: see `excite check`, "
                    "and plan the motion anew."
                )
