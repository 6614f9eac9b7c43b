"""Units in which small and large torques read well."""


def readable_unit(unit: str, largest: float) -> tuple[float, str]:
    """Factor and unit for values up to `largest`: N·m becomes kN·m, mN·m or µN·m."""
    if largest >= 1e3:
        return 1e-3, f"k{unit}"
    if largest < 1e-5:
        return 1e6, f"µ{unit}"
    if largest < 1e-2:
        return 1e3, f"m{unit}"
    return 1.0, unit


def torque_or_force(unit: str) -> str:
    """What is measured in `unit`."""
    return "torque" if unit.endswith("N·m") else "force"
