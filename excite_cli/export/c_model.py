"""A model as one C file: recursive Newton–Euler with its inertias, and the code of its effects.

Every effect states its own C (`Effect.in_c`); the file is `model_template.c` with its gaps filled.
"""

import re
from collections.abc import Callable
from importlib.resources import files

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.effects.mechanism import real, reals
from excite_cli.effects.sign import WIDTH
from excite_cli.export.c_text import braced, filled, wrapped
from excite_cli.export.exported import ModelText, in_words
from excite_cli.export.std_in_c import TEST_COLUMN, std_in_c
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.regression import Series
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import Tree, tree_of
from excite_cli.scoring.thresholds import REVERSAL, Residual, Thresholds
from excite_cli.scoring.validity import Trust

# The collision detector of a model's C file: thresholds, their low pass, and a test of both.


def detector_in_c(thresholds: Thresholds, count: int, step: float) -> str:
    """Its code; the test runs over `count` instants, `step` [s] apart."""
    text = (files("excite_cli.export") / "detector_template.c").read_text(encoding="utf-8")
    rows = np.column_stack([thresholds.coefficients, thresholds.level])
    gaps = {
        "FALSE_ALARMS": f"{thresholds.false_alarms:g}",
        "SOUND": braced(rows),
        "TIME_CONSTANT": real(thresholds.time_constant),
        "REVERSAL": real(REVERSAL),
        "TEST_STEP": repr(step),
        "DETECTED": wrapped(_detector_in_c_tested(thresholds, count, step)),
    }
    return filled(text, gaps)


def _detector_in_c_tested(thresholds: Thresholds, count: int, step: float) -> Array:
    """Filtered residuals over their thresholds (count, n), of the series that the C code makes."""
    k, j = np.arange(count)[:, None], np.arange(len(thresholds.joint_names))
    residual, speed = np.sin(0.7 * k + j), 0.2 * np.cos(0.3 * k + 2.0 * j)
    run = Residual(residual, speed, 10.0 * np.sin(0.11 * k + j), step)
    return thresholds.filtered(run.residual, step) / thresholds.at(run.speed, run.load)


# Names in comments of C: nothing in them ends a comment, begins one or joins two lines.

_PAIRS = re.compile(r"\*(?=/)|/(?=\*)|\?(?=\?)")  # ends, beginnings, trigraphs


def in_comment(words: str) -> str:
    """`words` with spaces in pairs that C reads, and `<U+000A>` for what has no glyph of its own.

    So is a backslash, which joins lines, and a sign that turns the direction of a text round.
    """
    spaced = _PAIRS.sub(lambda pair: f"{pair.group()} ", words).replace("@", "(at)")
    return "".join(
        each if each.isprintable() and each != "\\" else f"<U+{ord(each):04X}>" for each in spaced
    )


_TESTED, _STEP, _SEED = 24, 0.01, 20170529
_NO_STD = ":\n *                  not in this file, as {}"
_UNHEARD = "the model does not say what it left of its own data"
_UNKNOWN = "C has no code for some effect"


def c_model(
    robot: Robot,
    model: IdentifiedModel,
    made: str = "",
    thresholds: Thresholds | None = None,
    trust: Trust | None = None,
) -> ModelText:
    """The C file, and what it leaves out; `made`: where the model comes from, in a few words.

    With `thresholds` a collision detector is in it; with `trust`, which `model` has of its own
    data, the standard deviation of the torque, unless C has no code for some effect.
    """
    kept = model.without(model.of_single_runs)
    columns = tuple(dict.fromkeys(each.covariate for each in kept.effects if each.covariate))
    codes = [(effect, effect.in_c(values, columns)) for effect, values in kept.by_effect]
    series = [effect.in_c_series(values) for effect, values in kept.by_effect]
    unknown = tuple(
        effect
        for (effect, code), whole in zip(codes, series, strict=True)
        if not (code or whole or effect.carried)
    )
    kept = kept.without(unknown)
    names = robot.joint_names
    left = [*model.of_single_runs, *unknown]
    text = (files("excite_cli.export") / "model_template.c").read_text(encoding="utf-8")
    tree = tree_of(robot)
    tested = _tested_series(robot, columns)
    gaps = {
        "ROBOT": in_comment(robot.name),
        "MADE": in_comment(made),
        "JOINTS": _lines(f"{j} {name}" for j, name in enumerate(names)),
        "COLUMNS": _lines(f"{k} {name}" for k, name in enumerate(columns)),
        "EFFECTS": _lines(in_words(kept.effects, names).split("; ") if kept.effects else ()),
        "LEFT": _lines(in_words(left, names).split("; ") if left else ()),
        "N": str(robot.n),
        "M": str(len(tree.joints)),
        "NCOLUMNS": str(len(columns)),
        "WIDTH": repr(WIDTH),
        "RATES": str(int(any("_rate" in code or "load_bend" in code for _, code in codes))),
        "TREE": _tree(tree),
        "BODIES": _bodies(kept.phi, tree),
        "LOADED": _bodies(kept.phi + kept.carried(robot), tree),
        "DETECTOR": "" if thresholds is None else detector_in_c(thresholds, _TESTED, _STEP),
        "COLUMN": ", const real column[EXCITE_COLUMNS]" if columns else "",
        "COLUMN_GIVEN": "column" if columns else "0",
        "GRAVITY": reals(tree.gravity),
        "FRICTION": _code(codes, lambda effect: effect.is_friction),
        "ROBOT_EFFECTS": _code(codes, lambda e: not (e.data_defect or e.is_friction)),
        "DEFECTS": _code(codes, lambda effect: effect.data_defect),
        "SERIES_EFFECTS": "\n".join(f"    {code}" for code in series if code),
        **_tested(robot, kept, tested),
        "STD_COLUMN": TEST_COLUMN if columns else "",
        "STD": "" if trust is None or unknown else std_in_c(robot, model, kept, trust, tested),
        "NO_STD": "" if trust and not unknown else _NO_STD.format(_UNKNOWN if trust else _UNHEARD),
    }
    notes = []
    if model.of_single_runs:
        notes.append(
            f"not in it, since only some recordings had them: "
            f"{in_words(model.of_single_runs, names)}"
        )
    if unknown:
        notes.append(f"C has no code for: {in_words(unknown, names)}")
    return ModelText(filled(text, gaps), tuple(notes))


def _code(codes: list[tuple[Effect, str]], chosen: Callable[[Effect], bool]) -> str:
    kept = (code for effect, code in codes if chosen(effect) and code)
    return "\n".join(f"    {code}" for code in kept)


def _tree(tree: Tree) -> str:
    rows = (
        f"    {{{joint.parent}, {int(joint.sliding)}, {{{reals(joint.rotation)}}}, "
        f"{{{reals(joint.position)}}}, {{{reals(joint.axis)}}}, "
        f"{joint.driver}, {joint.multiplier!r}, {joint.offset!r}}}"
        for joint in tree.joints
    )
    return ",\n".join(rows)


def _bodies(phi: Array, tree: Tree) -> str:
    return braced(phi.reshape(-1, 10)[tree.first_body :])


def _tested_series(robot: Robot, columns: tuple[str, ...]) -> Series:
    """A series with reversals."""
    rng = np.random.default_rng(_SEED)
    t: Array = np.asarray(_STEP * np.arange(_TESTED))
    rates, phases = rng.uniform(5.0, 25.0, robot.n), rng.uniform(0.0, 6.0, robot.n)
    angle = np.outer(t, rates) + phases
    q = 0.1 * np.sin(angle) + rng.uniform(-1.0, 1.0, robot.n)
    v, a = 0.1 * rates * np.cos(angle), -0.1 * rates**2 * np.sin(angle)
    logged = {name: 20.0 + rng.uniform(0.0, 20.0, len(t)) for name in columns}
    return Series(t, q, v, a, covariates=logged)


def _tested(robot: Robot, model: IdentifiedModel, tested: Series) -> dict[str, str]:
    """The test's series, and its torques."""
    columns = [*tested.covariates.values()]
    column = np.stack(columns, axis=1) if columns else np.zeros(0)
    return {
        "TESTED": str(_TESTED),
        "TEST_STEP": repr(_STEP),
        "TEST_Q": wrapped(tested.q),
        "TEST_V": wrapped(tested.v),
        "TEST_A": wrapped(tested.a),
        "TEST_TAU": wrapped(model.predicted(robot, tested).torque),
        "TEST_COLUMN": wrapped(np.append(column, 0.0)),
    }


def _lines(words: object) -> str:
    found = [f" *   {in_comment(word)}" for word in words]  # type: ignore[attr-defined]
    return "\n".join(found) or " *   none"
