"""Columns in another order than their names say."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from excite_cli.checks.setup import Order, Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec

_ALONE = 0.35  # price, in L, of positions that are exchanged without their torques


def _orders(n: int) -> Iterator[Order]:
    """Two exchanged, all shifted, all turned round."""
    here = np.arange(n)
    for pair in combinations(range(n), 2):
        order = here.copy()
        order[list(pair)] = pair[::-1]
        yield order
    if n > 2:
        yield from (np.roll(here, shift) for shift in range(1, n))
        yield here[::-1].copy()


class ColumnOrder(SetupCheck):
    """Order of columns: positions, torques, or both together."""

    name = "order of columns"
    kind = "order"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Everything one step away."""
        for order in _orders(len(setup.zero)):
            joints = tuple(int(j) for j in np.flatnonzero(order != np.arange(len(order))))
            for what, positions, torques in (
                ("columns", order, order), ("torques", None, order), ("positions", order, None),
            ):  # fmt: skip
                price = _ALONE if what == "positions" else 0.0
                exchanged = setup.exchanged(positions, torques)
                yield Alternative(exchanged, joints, what, price)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """What stands where."""
        order, what = _changed(before, after)
        moved = np.flatnonzero(order != np.arange(len(names))).tolist()
        if len(moved) == 2:
            return f"the {what} of {names[moved[0]]} and {names[moved[1]]} are swapped"
        listed = ", ".join(f"{names[order[j]]} holds {names[j]}" for j in moved)
        return f"the {what} are in another order than their names ({listed})"

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """Names of the columns, where both positions and torques have another order."""
        order, what = _changed(before, after)
        moved = np.flatnonzero(order != np.arange(len(names))).tolist()
        given = spec.measurement
        column = {joint: name for name, joint in given.names.items()}
        torque = column | {joint: name for name, joint in given.torque_names.items()}
        new = {column.get(names[order[j]], names[order[j]]): names[j] for j in moved}
        same = {torque.get(names[j], names[j]): names[j] for j in moved}
        here = {torque.get(names[order[j]], names[order[j]]): names[j] for j in moved}
        if what == "torques":
            return {"measurement.torque_names": {**given.torque_names, **here}}
        found: Settings = {"measurement.names": {**given.names, **new}}
        if what == "positions" or given.torque_names:
            own = same if what == "positions" else here
            found["measurement.torque_names"] = {**given.torque_names, **own}
        return found


def _changed(before: Setup, after: Setup) -> tuple[Order, str]:
    q, tau = (
        np.argsort(a)[b]
        for a, b in ((before.q_order, after.q_order), (before.tau_order, after.tau_order))
    )
    here = np.arange(len(q))
    if (q == here).all():
        return tau, "torques"
    return q, "columns" if (q == tau).all() else "positions"
