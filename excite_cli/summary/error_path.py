"""The error against the number of effects, and the smallest model that is about as good."""

from excite_cli.diagnosis.records import Diagnosis, ErrorPath
from excite_cli.shown.table import Parts, Table
from excite_cli.summary.named_effects import what_and_where


def path_parts(found: Diagnosis, verbose: bool) -> Parts:
    """One sentence if there is a smaller model; with `verbose` the whole path as a table."""
    path = found.path
    if path is None:
        return []
    parts: Parts = [_table(found, path)] if verbose else []
    if path.smallest < len(path.effects):
        parts.append(smallest_in_words(path))
    return parts


def smallest_in_words(path: ErrorPath) -> str:
    """How many effects are enough, by what, and what that costs on held-out data."""
    count, least = path.smallest, path.left_out[path.best]
    text = (
        f"{count} of the {len(path.effects)} effects are enough: on training data left out they "
        f"leave {path.left_out[count]:.1%} of the declared model's error, all of them "
        f"{path.left_out[-1]:.1%}; the least is {least:.1%} ± {path.standard_error:.1%}. Held-out: "
        f"{path.held_out[count]:.2%} with {count}, {path.held_out[-1]:.2%} with all. "
        "--apply NEW.yaml --smallest writes these alone."
    )
    if not path.enough:
        text += " (Two runs say little of that standard error.)"
    return text


def _table(found: Diagnosis, path: ErrorPath) -> Table:
    everything = len(found.joint_names)
    names = ["none", *(what_and_where(found.effects[i].effect, everything) for i in path.effects)]
    marks = {path.best: "least", path.smallest: "smallest"}
    rows = tuple(
        (str(k), name, f"{path.left_out[k]:.2%}", f"{path.held_out[k]:.2%}", marks.get(k, ""))
        for k, name in enumerate(names)
    )
    return Table(
        "Error with the first effects (left out: of the declared model's; held out: of the torque)",
        ("effects", "with", "left out", "held-out", ""),
        rows,
        left=("with", ""),
        bold=(path.smallest,),
    )
