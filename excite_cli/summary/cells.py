"""Numbers in tables; what is not known is "-"."""

from math import isnan


def percent(share: float) -> str:
    """12.34%."""
    return "-" if isnan(share) else f"{share:.2%}"


def figure(value: float) -> str:
    """Four digits."""
    return "-" if isnan(value) else f"{value:.4g}"
