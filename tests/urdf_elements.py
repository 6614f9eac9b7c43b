"""Links and joints of a URDF as text, for tests that write robots of their own."""

_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
LIMITS = 'lower="-2" upper="2" velocity="3" effort="50"'


def robot_text(name: str, *parts: str) -> str:
    """The text of a URDF."""
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def link(
    name: str,
    mass: float = 1,
    moments: str = "1 1 1",
    center: str = "0 0 0",
    shapes: str = "",
    turn: str = "",
) -> str:
    """A link [kg, kg m², m, rad] with its `shapes` as elements.

    `moments` are ixx iyy izz, and ixy ixz iyz unless they are 0; `turn` is that of their axes.
    """
    values = (moments + " 0 0 0").split()
    inertia = " ".join(f'{key}="{value}"' for key, value in zip(_MOMENTS, values, strict=False))
    return (
        f'<link name="{name}"><inertial>{_origin(center, turn)}<mass value="{mass}"/>'
        f"<inertia {inertia}/></inertial>{shapes}</link>"
    )


def joint(
    name: str,
    ends: tuple[str, str],
    place: str = "0 0 0",
    axis: str = "0 0 1",
    limits: str = LIMITS,
    kind: str = "revolute",
    turn: str = "",
    more: str = "",
) -> str:
    """A joint between a parent and a child, the `ends`; `more` are elements, as of a mimic."""
    limit = f"<limit {limits}/>" if limits else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/>'
        f'{_origin(place, turn)}<axis xyz="{axis}"/>{limit}{more}</joint>'
    )


def box(size: str, place: str = "0 0 0") -> str:
    """A collision shape."""
    return f'<collision>{_origin(place)}<geometry><box size="{size}"/></geometry></collision>'


def _origin(place: str, turn: str = "") -> str:
    angles = f' rpy="{turn}"' if turn else ""
    return f'<origin xyz="{place}"{angles}/>'
