"""What a robot carries, as the text that its controller reads: URScript, and Franka's JSON.

Both take mass [kg], centre of mass [m] in the frame of the tool flange, and the inertia about that
centre [kg·m²] along the flange's axes; products of inertia are entries of the tensor, as in a URDF.

- URScript (Universal Robots, Script Manual, page "set_target_payload"): set_target_payload(m, cog,
  inertia) with [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]; older controllers have set_payload(m, cog), which
  that page calls deprecated.
- endeffector-config.json (Franka Robotics, RIDE CLI documentation, page "End effector
  commissioning"): `mass`, `centerOfMass`, `inertia`, 9 entries column by column, and
  `transformation`, 16 entries column by column, from the flange to the end effector. That centre
  and inertia are so is said of F_x_Cee and I_ee by libfranka, "RobotState".
"""

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from excite_cli.effects.catalogue import carried_body
from excite_cli.errors import ConfigError
from excite_cli.export.exported import ModelText, ten_as_body
from excite_cli.identification.carried_load import LoadIdentification
from excite_cli.robot.link_frame import links_ending
from excite_cli.robot.model import Array, Robot

_FLANGES = {"ur": "tool0", "franka": "link8"}  # the end of its link's name, in the makers' URDFs
_SURE = 2.0  # standard deviations: of less mass the centre is not known
_APART = 3.0  # and by more of them, the nearest possible body is another one
_DIGITS, _OF_INERTIA = 6, 9  # mg, µm; 10⁻⁹ kg·m²


def flange_of(robot: Robot, format: str) -> str:
    """The link whose frame the controller's is.

    Raises
    ------
    ConfigError
        Not exactly one link is called so.
    """
    end = _FLANGES[format]
    found = links_ending(robot, end)
    if len(found) != 1:
        raise ConfigError(
            f"--{format}: the robot has {len(found)} links named …{end}, the flange whose frame "
            "the controller uses. Name the link that has this frame with --link."
        )
    return found[0]


def payload_text(load: LoadIdentification, format: str) -> ModelText:
    """The load as `ur` (URScript) or `franka` (JSON); where need be, the nearest possible body.

    Raises
    ------
    ConfigError
        No body has nearly these numbers, or the mass may be zero.
    """
    ten, notes = load.values, []
    why = _why_not(load, ten)
    if not why and not carried_body(0).possible(ten):
        ten = carried_body(0).nearest(ten, load.covariance)
        why = _why_not(load, ten)
        notes = ["holds the nearest possible body, which is within the error of the one found"]
    if why:
        raise ConfigError(
            f"--{format}: the payload found on {load.link} is not written, since {why}; identify "
            "it without this option to see its numbers, and play a longer motion."
        )
    kilograms, centre, inertia = ten_as_body(ten)
    text, more = _FORMATS[format](
        round(kilograms, _DIGITS), centre.round(_DIGITS) + 0.0, inertia.round(_OF_INERTIA) + 0.0
    )
    return ModelText(text, (*notes, f"the frame is that of {load.link}", *more))


def _why_not(load: LoadIdentification, ten: Array) -> str:
    """Why no controller is told this body, `ten` (10,) its parameters; empty: it can be."""
    found, mass = load.parameters, load.parameters["mass"]
    if mass.value <= _SURE * mass.std:
        return f"its mass, {mass.value:.3g} ± {mass.std:.2g} kg, may be zero"
    told = (found[name] for name in ("mass", "cx", "cy", "cz"))
    own = (ten[0], *ten[1:4] / ten[0])
    off = (abs(x - each.value) / each.std for x, each in zip(own, told, strict=True))
    return "" if load.possible and max(off) <= _APART else "it is not a possible body"


def urscript(mass: float, centre: Array, inertia: Array) -> str:
    """Lines of URScript that set it; mass [kg], centre (3,) [m], inertia (3, 3) [kg·m²]."""
    six = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    cog = _listed(centre)
    return (
        f"set_target_payload({mass!r}, {cog}, {_listed(six)})\n"
        "# A controller that does not know set_target_payload takes the next line instead:\n"
        f"# set_payload({mass!r}, {cog})\n"
    )


def franka_json(mass: float, centre: Array, inertia: Array) -> str:
    """endeffector-config.json, its end effector in the flange's frame; units as `urscript`."""
    tree: dict[str, Any] = {
        "mass": mass,
        "centerOfMass": centre.tolist(),
        "transformation": np.eye(4).ravel(order="F").tolist(),
        "inertia": inertia.ravel(order="F").tolist(),
    }
    return json.dumps(tree) + "\n"


def _listed(values: Any) -> str:
    """`[0.0, 0.0, 0.05]`; nothing with an exponent, which not every reader takes."""
    return f"[{', '.join(np.format_float_positional(x, trim='0') for x in values)}]"


_FORMATS: dict[str, Callable[[float, Array, Array], tuple[str, tuple[str, ...]]]] = {
    "ur": lambda *body: (urscript(*body), ()),
    "franka": lambda *body: (
        franka_json(*body),
        ("transformation is that of the flange: enter your tool centre point instead",),
    ),
}
