"""Changes over days: found with their day and size, and none where nothing changed."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.records import FrictionLine
from excite_cli.effects.parameter import Value
from excite_cli.scoring.changes import Known, Snapshot, changes_of, of_diagnosis
from excite_cli.summary.changes import changes_tables, sentences
from tests.diagnosis.synthetic_diagnosis import make_diagnosis

DAYS = 12


def year(
    rng: np.random.Generator, step: float = 0.0, since: int = 6, swing: float = 0.0
) -> list[Snapshot]:
    temp = 25.0 + 10.0 * np.sin(2 * np.pi * np.arange(DAYS) / DAYS + 1.0)
    return [
        Snapshot(
            f"m{k}",
            {
                f"p{i}": Known(
                    5.0 + rng.normal(0.0, 0.05) + swing * (temp[k] - 25.0)
                    + (step if i == 3 and k >= since else 0.0),
                    0.05,
                    joint=f"j{i}",
                )
                for i in range(10)
            },
            covariates={"temp": float(temp[k])},
        )
        for k in range(DAYS)
    ]  # fmt: skip


def test_a_step_has_its_day_and_size_beside_a_temperature() -> None:
    found = changes_of(year(np.random.default_rng(1), step=0.5, swing=-0.03))
    (change,) = found.significant
    assert (change.name, change.joint, change.since) == ("p3", "j3", "m6")
    assert change.after - change.before == pytest.approx(0.5, abs=4 * change.std)
    assert change.std < 0.1
    assert change.taken_out["temp"] == pytest.approx(-0.03, abs=0.01)
    assert found.columns == ("temp",)


@pytest.mark.long
def test_years_without_a_change_are_left_alone() -> None:
    rng = np.random.default_rng(2)
    false = sum(bool(changes_of(year(rng, swing=-0.05)).significant) for _ in range(200))
    assert false <= 10  # 5 % of the years
    # Deviations that are too small raise no alarm.
    rng = np.random.default_rng(3)

    def narrow(day: Snapshot) -> Snapshot:
        known = {name: Known(x.value, x.std / 5.0) for name, x in day.known.items()}
        return Snapshot(day.name, known)

    false = sum(
        bool(changes_of([narrow(day) for day in year(rng)]).significant) for _ in range(100)
    )
    assert false <= 10


def test_two_days_are_a_difference() -> None:
    first, second = (
        Snapshot(name, {"a": Known(value, 0.01), "b": Known(1.0, 0.01)})
        for name, value in (("old", 1.0), ("new", 1.2))
    )
    found = changes_of([first, second])
    (change,) = found.significant
    assert change.name == "a"
    assert (change.before, change.after) == pytest.approx((1.0, 1.2))
    assert change.since == "new"
    # An effect that appears was zero and a parameter that is not known is not.
    days = [Snapshot(f"d{k}", {"x": Known(1.0, 0.01)}) for k in range(4)]
    days += [
        Snapshot(
            f"d{k}",
            {"x": Known(1.0, 0.01), "e": Known(2.0, 0.05, may_lack=True), "b": Known(9.0, 0.1)},
        )
        for k in (4, 5)
    ]
    found = changes_of(days)
    (change,) = found.significant
    assert (change.name, change.before, change.since) == ("e", pytest.approx(0.0), "d4")
    (other,) = [each for each in found.changes if each.name == "b"]
    assert np.isnan(other.values[:4]).all()


def test_what_changed_most_is_told_first_and_rows_fit_on_a_terminal() -> None:
    """Names of diagnoses are long sums; p of sure changes is too small a number to tell apart."""
    total = (
        "Izz[shoulder_lift_joint] + Ixx[elbow_joint] - 0.008·m[wrist_1_joint] - Iyy[elbow_joint]"
    )

    def day(name: str, friction: float, inertia: float) -> Snapshot:
        viscous, coulomb = Value(1.0, 1e-3, "N·m·s/rad"), Value(friction, 1e-3, "N·m")
        line = FrictionLine("shoulder_lift_joint", viscous, coulomb, curved=False)
        return of_diagnosis(
            name,
            replace(
                make_diagnosis(),
                base_names=(total,),
                base_values=np.array([inertia]),
                base_std=np.array([1e-3]),
                effects=(),
                friction_lines=(line,),
            ),
        )

    found = changes_of([day("january", 1.0, -0.0288), day("february", 2.0, -0.0738)])
    first, second = found.significant
    assert [first.name, second.name] == [
        "Coulomb friction[shoulder_lift_joint]",
        "Izz[shoulder_lift_joint]",
    ]
    (told, *_) = sentences(found)
    assert told.startswith("Coulomb friction[shoulder_lift_joint] rose from 1 to 2.0")
    assert "Izz[shoulder_lift_joint] changed from -0.0288 to -0.0738" in told
    assert "kg·m² since february" in told
    for table in changes_tables(found):
        widths = [max(map(len, column)) for column in zip(table.columns, *table.rows, strict=True)]
        assert sum(widths) + 2 * (len(widths) - 1) <= 100
