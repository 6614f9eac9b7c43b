"""Optimised and random motions side by side."""

from excite_cli.excitation.comparison import Comparison
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.shown.answer import Answer, Parts, Table
from excite_cli.shown.record import show
from excite_cli.summary.motions import motion_data


def comparison_answer(found: Comparison, output: str | None) -> Answer:
    """What `excite compare-random` answers."""
    baseline = found.baseline
    data = {
        "random": [
            {
                "index": m.index,
                "condition_number": m.condition_number,
                "stacked_condition_number": m.stacked_condition_number,
            }
            for m in baseline.motions
        ],
        "optimized": [motion_data(m) for m in found.result.motions],
        "candidates": baseline.candidates,
        "admissible": baseline.admissible,
        "seconds": {"optimized": found.seconds, "random": baseline.seconds},
        "output": output,
    }
    written = [output] if output is not None else []
    return Answer((*comparison_parts(found), *written), data)


def comparison_parts(found: Comparison) -> Parts:
    """The paper's Tables I and II side by side, and how long both took."""
    return [_table(found), _in_words(found)]


def _table(found: Comparison) -> Table:
    optimized, random = found.result.motions, found.baseline.motions
    rows = []
    for index in range(max(len(optimized), len(random))):
        first = optimized[index] if index < len(optimized) else None
        second = random[index] if index < len(random) else None
        ratio = (
            f"{second.stacked_condition_number / first.stacked_condition_number:.2f}"
            if first and second
            else ""
        )
        rows.append((str(index + 1), *_pair(first), *_pair(second), ratio))
    title = "Condition numbers, optimised and random (the paper's Tables I, II)"
    names = ("motion", "optimised", "stacked", "random", "random, stacked", "times worse")
    return Table(title, names, tuple(rows))


def _pair(motion: Motion | RandomMotion | None) -> tuple[str, str]:
    if motion is None:
        return "", ""
    return f"{motion.condition_number:.1f}", f"{motion.stacked_condition_number:.1f}"


def _in_words(found: Comparison) -> str:
    baseline = found.baseline
    return (
        f"{baseline.candidates} candidates in {baseline.seconds:.1f} s, {baseline.admissible} "
        f"admissible; the optimiser took {found.seconds:.1f} s"
    )


show(Comparison, _in_words, comparison_parts)
