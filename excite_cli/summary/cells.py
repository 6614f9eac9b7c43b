"""Numbers in tables; what is not known is "-"."""

from math import isnan


def percent(share: float) -> str:
    """12.34%."""
    return "-" if isnan(share) else f"{share:.2%}"


def points(share: float) -> str:
    """12.34 pp."""
    return "-" if isnan(share) else f"{100 * share:.2f} pp"


def figure(value: float) -> str:
    """Four digits."""
    return "-" if isnan(value) else f"{value:.4g}"
