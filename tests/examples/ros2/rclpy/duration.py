from dataclasses import dataclass


@dataclass
class Stamp:
    """builtin_interfaces/Time and Duration."""

    sec: int = 0
    nanosec: int = 0


class Duration:
    def __init__(self, *, seconds: float = 0.0, nanoseconds: int = 0) -> None:
        self.nanoseconds = int(seconds * 1e9) + nanoseconds

    def to_msg(self) -> Stamp:
        return Stamp(*divmod(self.nanoseconds, 10**9))
