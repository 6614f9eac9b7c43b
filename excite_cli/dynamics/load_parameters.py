"""The ten parameters of what a link carries, as the columns of a motion that is to show them."""

import numpy as np

from excite_cli.dynamics.base_parameters import DUST, BaseParameters
from excite_cli.dynamics.regressor import Regressor, standard_parameter_names
from excite_cli.errors import ConfigError
from excite_cli.robot.link_frame import carrying_frame
from excite_cli.robot.model import Robot

_SAMPLES, _SEED = 200, 20170529
_TELLS_APART = 1e-8


def load_parameters(robot: Robot, link: str | None) -> BaseParameters:
    """Mass, first moments and inertia about the joint that carries `link`, the robot being known.

    All ten are columns, whatever of them the robot's own parameters group.

    Raises
    ------
    ConfigError
        The link is unknown or must be named, or no motion tells all ten apart.
    """
    frame = carrying_frame(robot, link, "criterion.load_link")
    selection = 10 * (robot.model_joints[frame.joint] - 1) + np.arange(10)
    y = Regressor(robot).evaluate(*robot.draw_states(_SAMPLES, _SEED))[:, :, selection]
    rows = y.reshape(-1, 10)
    sizes = np.linalg.norm(rows, axis=0)
    names = standard_parameter_names(robot)
    if sizes.min() <= DUST * sizes.max() or (np.linalg.cond(rows / sizes) > 1.0 / _TELLS_APART):
        raise ConfigError(
            f"criterion.of: no motion of these joints shows all ten parameters of a load on "
            f"{frame.name}: a wrist with fewer axes turns it about some only. Move more joints "
            "(robot.joints)."
        )
    mapping = np.eye(10 * robot.n_bodies)[selection]
    return BaseParameters(selection, mapping, names, 0.0, 0.0)
