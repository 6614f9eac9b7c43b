"""The URDF as it is, with the friction of its <dynamics>: nothing is fitted.

python urdf_driver.py FOLDER ANSWER.npz
"""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pinocchio as pin
from exchange import read_given, write_answer


def main() -> None:
    given = read_given(Path(sys.argv[1]))
    # --- what a user writes
    model = pin.buildModelFromUrdf(str(given.urdf))
    data = model.createData()
    # --- until here
    columns = np.array([model.joints[model.getJointId(name)].idx_v for name in given.joints])
    order = np.argsort(columns)
    viscous, coulomb = friction(given.urdf, given.joints)
    torques = []
    for s in given.asked:
        tau = [pin.rnea(model, data, *(x[order] for x in each))[columns]
               for each in zip(s.q, s.v, s.a, strict=True)]  # fmt: skip
        torques.append(np.array(tau) + viscous * s.v + coulomb * np.sign(s.v))
    phi = np.array([inertia.toDynamicParameters() for inertia in model.inertias[1:]])
    write_answer(Path(sys.argv[2]), torques, phi)


def friction(urdf: Path, joints: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Viscous and Coulomb friction (n,) of <dynamics>, 0 where there is none."""
    told = {}
    for joint in ElementTree.parse(urdf).getroot().findall("joint"):
        dynamics = joint.find("dynamics")
        told[joint.get("name")] = {} if dynamics is None else dynamics.attrib
    return tuple(
        np.array([float(told[name].get(kind, 0.0)) for name in joints])
        for kind in ("damping", "friction")
    )


if __name__ == "__main__":
    main()
