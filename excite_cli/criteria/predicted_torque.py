"""Bayesian I-optimality: the standard deviation of torques that the work will ask for.

As `torque_deviation`, with three differences: the states are those of the work (`task` of the
config), beside the base parameters there are effects that the robot may have, and what is known of
all of these before any motion counts as data (`excitation/prediction.py`).
"""

from excite_cli.criteria.torque_deviation import TorqueDeviation


class PredictedTorque(TorqueDeviation):
    """Logarithm of the RMS standard deviation of a torque of the work."""

    name = "predicted_torque"
    of_work = True
    # UR10, Panda, TIAGo, Kinova, SO-100 and TALOS' arms, two seeds, three motions: the best of four
    # starts is 1 to 4 % better than one, for twice the time; so is a tolerance of 1e-3, by 1 %.
    restarts, tolerance = 1, 3e-3
