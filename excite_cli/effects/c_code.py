"""What the C code of effects is written with: numbers, and the names that stand for the state.

In the code of an effect `q`, `v`, `a` are the state, `s` the smoothed signs of the speeds, `load`
the torque that the gears carry, `torque` all of the robot's, `tau` what the code adds to, each with
an entry per joint; `t` and `start` are times in the recording and on the campaign's clock,
`column` further columns of the log, `load_rate`, `load_bend` and `torque_rate` the first and second
rates of those torques, `memory` what effects remember (`memory->since` is the time from the last
instant to this one); it is kept only where all of an instant is finite. `slopes(q, v, a, j, x, y,
z, out)` gives
x ∂τ/∂q_j + y ∂τ/∂v_j + z ∂τ/∂a_j of the rigid bodies, `tilted(roll, pitch, q, out)` what a turned
base adds, `pushed(f, q, out)` what a force at the tip does; the template says how.
"""

import numpy as np

from excite_cli.robot.model import Array


def real(x: float) -> str:
    """A number with all its digits."""
    return f"R({float(x)!r})"


def reals(x: Array) -> str:
    """Numbers with commas between them."""
    return ", ".join(real(each) for each in np.ravel(x))


def all_joints(call: str) -> str:
    """`call` fills `out` (EXCITE_JOINTS); it is added to the torque of all joints."""
    return f"{{ real out[N]; {call}; for (int i = 0; i < N; ++i) tau[i] += out[i]; }}"
