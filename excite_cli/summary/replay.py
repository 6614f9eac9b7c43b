"""How far models drift from the robot when its torques are played on them."""

from typing import Any

from excite_cli.scoring.replayed import Replay
from excite_cli.shown.answer import Answer
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts, Table


def replay_answer(found: Replay) -> Answer:
    """What `excite replay` answers; status 1 where the deviation did not fall."""
    return Answer(tuple(replay_parts(found)), _data(found), found.good)


def replay_parts(found: Replay) -> Parts:
    """A sentence, the deviations, and what the simulator cannot hold."""
    rows = tuple(
        (
            joint,
            "" if found.before is None else f"{1e3 * found.before[joint]:.2f}",
            f"{1e3 * after:.2f}",
            "mm" if joint in found.sliding else "mrad",
        )
        for joint, after in found.after.items()
    )
    return [
        _in_words(found),
        Table(
            "Deviation from the measured motion, RMS",
            ("joint", "URDF", "model", "unit"),
            rows,
            left=("joint", "unit"),
        ),
        *found.notes,
    ]


def _in_words(found: Replay) -> str:
    before, after = found.means
    over = f"{found.seconds:.3g} s of recorded torques"
    lost = f" {' and '.join(found.lost)} left all bounds." if found.lost else ""
    all_slide = set(found.after) <= set(found.sliding)
    unit = "mm" if all_slide else "mrad (mm)" if found.sliding else "mrad"
    if before is None:
        return f"Played with {over}, {found.model} deviates by {1e3 * after:.3g} {unit}.{lost}"
    verb = "instead of" if found.good else "and no less than"
    return (
        f"Played with {over}, {found.model} deviates from the robot by {1e3 * after:.3g} {unit} "
        f"{verb} the URDF's {1e3 * before:.3g} (mean over joints).{lost}"
    )


def _data(found: Replay) -> dict[str, Any]:
    """The answer for `--json`."""
    before, after = found.means
    return {
        "good": found.good,
        "answer": _in_words(found),
        "runs": list(found.names),
        "seconds": found.seconds,
        "before": found.before,
        "after": found.after,
        "mean": {"before": before, "after": after},
        "lost": list(found.lost),
        "notes": list(found.notes),
    }


show(Replay, _in_words, replay_parts)
