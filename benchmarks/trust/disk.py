"""Every command that writes, on a disk that fills up, is read-only or forbidden, or without a home.

    python -m benchmarks.trust.disk

Root only: each command runs in a small file system of its own in memory, over an old output, with
less room than it needs; then read-only; then as a user who may not write there; then as one whose
home does not exist. It must end with status 2, one message, the old output as it was, and nothing
else left; without a home it must work.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks.trust.kill import import_everything, make_inputs
from benchmarks.trust.kill_commands import COMMANDS, Command
from benchmarks.trust.killing import Reference, forked, run, undisturbed

SHARES = (0.0, 0.3, 0.6, 0.95)  # of the room that is needed for all that is written at once
_ROOM, _PAGE, _NOBODY = 32 << 20, 4096, 65534


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="this command alone")
    asked = parser.parse_args()
    if os.geteuid():
        sys.exit("benchmarks.trust.disk mounts file systems: run it as root.")
    import_everything()
    root = Path(tempfile.mkdtemp(prefix="excite-disk-"))
    root.chmod(0o755)
    os.environ["XDG_CACHE_HOME"] = str(root / "cache")
    try:
        make_inputs(root)
        wrong = []
        for command in COMMANDS:
            if asked.only in (None, command.name):
                wrong += _command(command, root)
        for each in wrong:
            print(each)
        sys.exit(1 if wrong else 0)
    finally:
        shutil.rmtree(root, ignore_errors=True)


def _command(command: Command, root: Path) -> list[str]:
    """All faults of one command; returns what went wrong."""
    reference = undisturbed(forked, command, root / "reference")
    seen, wrong = Counter[str](), list[str]()
    for share in SHARES:
        wrong += _full(command, reference, root / "full", share, seen)
    faults = [("read-only", "read-only", forked)]
    faults.append(("forbidden", "no permission", partial(forked, powerless=True)))
    for fault, words, start in faults:
        folder = _mounted(root / "closed", reference)
        if fault == "read-only":
            _mount("remount,ro", folder)
        else:
            os.chown(folder, _NOBODY, _NOBODY)
        ended = run(start, (*command.arguments, "--overwrite"), folder)
        wrong += _judged(command, reference, folder, ended.status, words, fault)
        seen[fault] += 1
        _unmount(folder)
    folder = _mounted(root / "open", reference)
    home = {"HOME": "/proc/nobody", "XDG_CACHE_HOME": "", "MPLCONFIGDIR": ""}
    ended = run(
        partial(forked, powerless=True), (*command.arguments, "--overwrite"), folder, None, home
    )
    if ended.status:
        wrong.append(f"{command.name}, no home: {_said(folder)}")
    seen["no home"] += 1
    _unmount(folder)
    shutil.rmtree(reference.folder)
    told = ", ".join(f"{count} {what}" for what, count in seen.items())
    print(f"{command.name:18} {told}; {len(wrong)} wrong", flush=True)
    return wrong


def _full(
    command: Command, reference: Reference, folder: Path, share: float, seen: Counter[str]
) -> list[str]:
    """Run with room for `share` of what is needed beside the old output."""
    _mounted(folder, reference)
    needed = _largest(reference.folder)
    room = _free(folder) - int(share * needed) // _PAGE * _PAGE
    with (folder / "filler").open("wb") as file:
        file.write(b"x" * room)
    ended = run(forked, (*command.arguments, "--overwrite"), folder)
    (folder / "filler").unlink()
    wrong = []
    if os.waitstatus_to_exitcode(ended.status) == 0:
        seen["fitted"] += 1
    else:
        seen["full"] += 1
        status, words = ended.status, "no space is left"
        wrong = _judged(command, reference, folder, status, words, f"full at {share}")
    _unmount(folder)
    return wrong


def _judged(
    command: Command, reference: Reference, folder: Path, status: int, words: str, fault: str
) -> list[str]:
    """Status 2, one error with `words`, whole files, nothing else."""
    wrong = []
    if os.waitstatus_to_exitcode(status) != 2:
        wrong.append(f"status {os.waitstatus_to_exitcode(status)}")
    errors = [line for line in _said(folder).splitlines() if line.startswith("error: ")]
    if len(errors) != 1 or words not in errors[0] or "Traceback" in _said(folder):
        wrong.append(f"says: {_said(folder)[-500:]}")
    for name, read in command.outputs.items():
        if not (folder / name).exists():
            wrong.append(f"{name} is gone")
        elif not command.resumable and read(folder / name) != reference.contents[name]:
            wrong.append(f"{name} is broken")
        else:
            read(folder / name)
    over = {each.name for each in folder.iterdir()} - set(command.outputs)
    wrong += [f"left: {', '.join(sorted(over))}"] if over else []
    return [f"{command.name}, {fault}: {each}" for each in wrong]


def _mounted(folder: Path, reference: Reference) -> Path:
    """A file system of its own with the old output in it."""
    folder.mkdir(exist_ok=True)
    subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={_ROOM},mode=755", "tmpfs", str(folder)], check=True
    )
    shutil.copytree(reference.folder, folder, dirs_exist_ok=True)
    return folder


def _mount(options: str, folder: Path) -> None:
    subprocess.run(["mount", "-o", options, str(folder)], check=True)


def _unmount(folder: Path) -> None:
    subprocess.run(["umount", str(folder)], check=True)


def _free(folder: Path) -> int:
    state = os.statvfs(folder)
    return state.f_bavail * state.f_frsize


def _largest(folder: Path) -> int:
    """Bytes of the largest output: each is written beside the old one, and then takes its place."""
    return max(
        sum(each.stat().st_size for each in (*path.rglob("*"), path) if each.is_file())
        for path in folder.iterdir()
    )


def _said(folder: Path) -> str:
    return (folder.parent / "said.txt").read_text()


if __name__ == "__main__":
    main()
