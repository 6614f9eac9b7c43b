"""How a command ends: its exit status, and one message where something went wrong.

The message is text or, with `--json`, one JSON object: `error`, `kind` and `exit_status`.
"""

import errno
import json
import os
import platform
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from excite_cli import __version__
from excite_cli.api.outputs import leave_claims
from excite_cli.cli.console import harmless, is_unicode, tell_message
from excite_cli.cli.stopping import stopped
from excite_cli.errors import REFUSALS, ExciteError, refusal

BUG, INTERRUPTED = 70, 130


def run_guarded(action: Callable[[], None]) -> int:
    """Run a command; return its exit status, with one message instead of a traceback."""
    status: Any = 0
    try:
        try:
            action()
        except SystemExit as ended:
            status = ended.code
        sys.stdout.flush()
    except ExciteError as error:
        return _ended(error, str(error), error.exit_status)
    except KeyboardInterrupt as error:
        status, words = stopped(sys.argv[1:])
        return _ended(error, words, status)
    except MemoryError as error:
        return _ended(error, f"out of memory; {_less_memory(sys.argv[1:])}.", 2)
    except OSError as error:
        return _refused(error)
    except Exception as error:
        return _bug(error)
    finally:
        leave_claims()
    return status if isinstance(status, int) else 0


def _ended(error: BaseException, words: str, status: int) -> int:
    """Tell why, on the last line of stderr as one JSON object with `--json`; return the status."""
    if "--json" in sys.argv:
        data = {"error": words, "kind": type(error).__name__, "exit_status": status}
        print(json.dumps(data, ensure_ascii=not is_unicode(sys.stderr)), file=sys.stderr)
    else:
        tell_message(words if isinstance(error, KeyboardInterrupt) else f"error: {words}")
    return status


def _less_memory(arguments: Sequence[str]) -> str:
    """What takes less memory, for the command line `arguments`."""
    measured = {
        "diagnose": "take fewer runs, fewer samples or fewer candidates (diagnosis.kinds)",
        "identify": "take fewer runs or fewer samples",
    }
    command = next((each for each in arguments if not each.startswith("-")), "")
    return measured.get(command, "take fewer samples, harmonics or joints")


# Nothing that a user could fix: the program looked for a file that it should have asked for.
_OUR_FAULT = (errno.ENOENT, errno.EEXIST)
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def _refused(error: OSError) -> int:
    """What the file system refused, to a file or to the output."""
    printed = error.filename is None and error.errno in _FULL
    if error.errno not in REFUSALS or error.errno in _OUR_FAULT:
        return _bug(error)
    if error.filename is None and not printed:
        return _bug(error)
    if printed:
        _print_nowhere()
    where = "standard output" if printed else error.filename
    return _ended(error, f"{where}: {refusal(error)}", 2)


def _print_nowhere() -> None:
    """So that Python's own last flush does not fail once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _bug(error: Exception) -> int:
    """One message on what to report; the traceback with --verbose."""
    if {"--verbose", "-v"} & set(sys.argv):
        sys.stderr.write(harmless(traceback.format_exc()))
        ask = "Please report it: the command, and all that is printed above."
    else:
        ask = "Please run the command again with --verbose, and report it with what that prints."
    last = traceback.extract_tb(error.__traceback__)[-1:]
    place = "".join(f" at {Path(frame.filename).name}:{frame.lineno}" for frame in last)
    words = (
        f"a bug of excite, not of your input ({type(error).__name__}{place}: {error}).\n"
        f"{ask}\n"
        f"excite {__version__}, Python {platform.python_version()}, {platform.platform()}"
    )
    return _ended(error, words, BUG)
