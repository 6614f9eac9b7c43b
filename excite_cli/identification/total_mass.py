"""The mass of the whole robot as a sum of base parameters: what scales under it know.

Where the wrench at the base is measured, the weight shows: 1ᵀm = wᵀ φ_B with mappingᵀ w = the
indicator of the masses. Links that are locked or held count with the body that carries them.
"""

import numpy as np
from scipy.linalg import lstsq

from excite_cli.dynamics.base_parameters import BaseParameters
from excite_cli.dynamics.regressor import PARAMETERS_PER_BODY
from excite_cli.errors import ConfigError
from excite_cli.robot.model import Array, Robot

_VISIBLE = 1e-6  # of a mass: what is more than rounding belongs to a mass that does not show


def total_mass_row(robot: Robot, base: BaseParameters) -> Array:
    """w (r,) with wᵀ φ_B the mass of all bodies [kg].

    Raises
    ------
    ConfigError
        The whole mass does not show in the measured rows.
    """
    masses = np.zeros(base.mapping.shape[1])
    masses[robot.massless * PARAMETERS_PER_BODY :: PARAMETERS_PER_BODY] = 1.0
    w = np.asarray(lstsq(base.mapping.T, masses)[0])
    if not robot.base_joints or np.abs(base.mapping.T @ w - masses).max() > _VISIBLE:
        raise ConfigError(
            "identification.total_mass: the whole mass of this robot does not show in what is "
            "measured. It does in the wrench at a floating base with gravity (robot.base: "
            "floating, robot.rows with base). Without that, weigh a payload instead and record a "
            "run with it: identification.known_payload."
        )
    return w
