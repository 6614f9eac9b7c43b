"""NumPy archive: t (T,), q, v, a (T, n), joint_names (n,); numbers and text, no pickles."""

from pathlib import Path

import numpy as np

from excite_cli.export.motion_exporter import MotionExporter, states_of
from excite_cli.measurement.timed_motion import TimedMotion


class NpzExporter(MotionExporter):
    """`.npz`."""

    name, suffix = "npz", ".npz"

    def _write(self, path: Path, motion: TimedMotion) -> None:
        q, v, a = states_of(motion)
        names = np.array(motion.joint_names, dtype=np.str_)
        with path.open("wb") as file:
            np.savez_compressed(file, t=motion.t, q=q, v=v, a=a, joint_names=names)
