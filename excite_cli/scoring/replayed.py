"""What a replay holds, as a frozen record."""

from dataclasses import dataclass

from excite_cli.shown.record import Shown


@dataclass(frozen=True, repr=False)
class Replay(Shown):
    """RMS deviation [rad] (m) from the measured motion, by joint, of recorded torques played.

    `before` on the URDF untouched (None where that has no masses), `after` on the exported model;
    over `seconds` of the runs `names`. `lost`: models that left all bounds. `notes`: what the
    exported model cannot hold.
    """

    model: str
    names: tuple[str, ...]
    seconds: float
    before: dict[str, float] | None
    after: dict[str, float]
    lost: tuple[str, ...] = ()
    sliding: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def means(self) -> tuple[float | None, float]:
        """Mean over the joints, before and after."""
        before = None if self.before is None else sum(self.before.values()) / len(self.before)
        return before, sum(self.after.values()) / len(self.after)

    @property
    def good(self) -> bool:
        """Whether the deviation fell, or there is nothing to compare with."""
        before, after = self.means
        return before is None or after < before
