"""Exceptions that travel from a worker to the caller."""

import pickle
import traceback

from excite_cli.errors import ExciteError


def able_to_travel(error: Exception) -> Exception:
    """The error itself with its traceback as a note, or the nearest that can be pickled.

    An exception whose constructor wants more than its message does not come back from a pickle;
    then its first base class that does is taken, with the same message.
    """
    if not isinstance(error, ExciteError):
        error.add_note("In a worker:\n" + "".join(traceback.format_exception(error)))
    for kind in (None, *type(error).__mro__):
        try:
            candidate = error if kind is None else _as(error, kind)
            back = pickle.loads(pickle.dumps(candidate))
        except Exception:  # whatever a foreign exception does when it is pickled
            continue
        if isinstance(back, Exception) and str(back) == str(error):
            return candidate
    return RuntimeError(f"{type(error).__name__}: {error}")


def _as(error: Exception, kind: type) -> Exception:
    other = kind(str(error))
    if not isinstance(other, Exception):
        raise TypeError(kind)
    for note in getattr(error, "__notes__", ()):
        other.add_note(note)
    return other
