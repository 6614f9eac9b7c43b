"""A process that reads an untrusted file gives up what it does not need, for good.

On Linux, by Landlock (files: kernel 5.13; TCP: 6.7) and by seccomp (sockets, starting programs,
looking into other processes, changing modes and owners). Neither needs privileges, and neither can
be taken back by whoever gains control of the process. Elsewhere, or where the kernel lacks one of
them, what could not be given up is returned, so that it can be said.
"""

import contextlib
import ctypes
import os
import platform
import signal
import struct
import sys
import sysconfig
from collections.abc import Iterable
from pathlib import Path

from excite_cli.measurement.memory_limit import address_space

# What a process of its own needs that reads an untrusted file in place of this one.
#
# The libraries that read meshes and robots in C can be led by a damaged file to end their process,
# to fill memory or to run on; nothing in the same process can hold them then.

# Threads of linear algebra, of no use here, reserve much of the memory that there is.
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")}


# Beginnings of names of variables.
_NEEDED = ("PATH", "HOME", "LANG", "LC_", "TMP", "TEMP", "XDG_CACHE_HOME", "PYTHON", "VIRTUAL_ENV",
           "LD_LIBRARY_PATH", "DYLD_", "SYSTEMROOT", "ROS_DISTRO", "ROS_VERSION")  # fmt: skip


def command(module: str) -> list[str]:
    """Words that start Python on `module`'s function `serve`.

    With this process's path of imports, so that a checkout finds itself; never (-P) with the
    current folder, where anything may lie.
    """
    boot = f"import sys; sys.path[:] = sys.argv[1:]; from {module} import serve; serve()"
    return [sys.executable, "-P", "-c", boot, *sys.path]


def environment(few: bool = False) -> dict[str, str]:
    """That of this process, with one thread for linear algebra.

    few: of it only what Python needs, and what a robot's file may ask for.
    """
    known = {k: v for k, v in os.environ.items() if not few or k.startswith(_NEEDED)}
    return {**known, **ONE_THREAD}


def limit_memory(most: int) -> None:
    """Of what this process may take beyond what it has [bytes]; where there is no limit, none."""
    try:
        import resource
    except ImportError:
        return
    limits = [(resource.RLIMIT_CORE, 0)]
    if (taken := address_space()) is not None:
        limits.append((resource.RLIMIT_AS, taken + most))
    for kind, value in limits:
        with contextlib.suppress(ValueError, OSError):  # a lower one holds already
            resource.setrlimit(kind, (value, value))


def set_alarm(seconds: float) -> None:
    """End this process once it has computed for so long; 0: not."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


# How a process ends by that alarm, or by being killed for taking too long.
OUT_OF_TIME = (-27, -9)


# Numbers of system calls that are the same on every processor.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_RULE_PATH_BENEATH = 1
_NO_NEW_PRIVS, _SET_SECCOMP, _FILTER = 38, 22, 2  # of prctl
# Rights of Landlock: of its first version bits 0 to 12, then one or more with each newer one.
_READ_FILE, _READ_DIR = 1 << 2, 1 << 3
_RIGHTS_BY_VERSION = {1: 13, 2: 14, 3: 15, 5: 16}  # how many rights over files
_OF_FILES = 1 << 1 | _READ_FILE | 1 << 14  # write, read, truncate: what a file can be given
_DEVICES = 1 << 15  # ioctl
_TCP, _SCOPED = 0b11, 0b11  # bind and connect; abstract sockets and signals
# Calls that are refused: socket, connect, execve, execveat, ptrace, process_vm_readv and _writev,
# io_uring_setup (which opens sockets by itself); and, since Landlock leaves them alone, chmod,
# chown, setxattr, utime and their kin, and unshare.
_REFUSED = {
    "x86_64": (
        0xC000003E,
        (
            *(41, 42, 59, 322, 101, 310, 311, 425),
            *(90, 91, 268, 452, 92, 93, 94, 260, 188, 189, 190, 132, 235, 261, 280, 272),
        ),
    ),
    "aarch64": (
        0xC00000B7,
        (198, 203, 221, 281, 117, 270, 271, 425, 52, 53, 452, 54, 55, 5, 6, 7, 88, 97),
    ),
}
_X32 = 0x40000000  # bit of calls of the 32-bit convention on x86_64
_ALLOW, _KILL, _ERROR_EPERM = 0x7FFF0000, 0x80000000, 0x00050001


def confine(readable: Iterable[Path], writable: Iterable[Path] = ()) -> tuple[str, ...]:
    """Leave this process only these files (with what lies below) and Python's own.

    Returns
    -------
    What could not be given up, in words; nothing where all was.
    """
    if sys.platform != "linux":
        return ("files and network (only Linux can confine a process here)",)
    os.umask(0o077)  # as files are made, for none can be changed to it later
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
        return ("files and network (the kernel refuses no_new_privs)",)
    lacking = []
    if not _restrict_files(libc, [*readable, *_of_python()], list(writable)):
        lacking.append("files (this kernel has no Landlock)")
    if not _refuse_calls(libc):
        lacking.append("network (this kernel has no seccomp filter for this processor)")
    return tuple(lacking)


def _of_python() -> list[Path]:
    """Where modules are imported from late, and libraries loaded; never the current folder."""
    package = Path(__file__).resolve().parents[1]
    names = ("stdlib", "platstdlib", "purelib", "platlib")
    places = [Path(sysconfig.get_path(name)) for name in names]
    places += [Path(each) for each in sys.path if Path(each).name.endswith("-packages")]
    system = ("/usr/lib", "/usr/lib64", "/lib", "/lib64", "/etc/ld.so.cache", "/dev/urandom")
    return [package, *places, *map(Path, system), Path(sys.base_prefix) / "lib"]


def _restrict_files(libc: ctypes.CDLL, readable: list[Path], writable: list[Path]) -> bool:
    version = libc.syscall(_CREATE_RULESET, None, 0, 1)
    if version < 1:
        return False
    count = max(bits for since, bits in _RIGHTS_BY_VERSION.items() if since <= version)
    rights = (1 << count) - 1
    fields = [rights, _TCP if version >= 4 else 0, _SCOPED if version >= 6 else 0]
    known = 3 if version >= 6 else 2 if version >= 4 else 1
    attributes = struct.pack(f"={known}Q", *fields[:known])
    rules = libc.syscall(_CREATE_RULESET, attributes, len(attributes), 0)
    if rules < 0:
        return False
    try:
        for path in readable:
            _allow(libc, rules, path, _READ_FILE | _READ_DIR)
        _allow(libc, rules, Path(os.devnull), _OF_FILES & rights)
        for path in writable:
            _allow(libc, rules, path, rights & ~(1 | _DEVICES))  # not to be executed
        return bool(libc.syscall(_RESTRICT_SELF, rules, 0) == 0)
    finally:
        os.close(rules)


def _allow(libc: ctypes.CDLL, rules: int, path: Path, rights: int) -> None:
    """Grant rights over a file, or over all below a folder; of what is not there, nothing."""
    try:
        at = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        if not path.is_dir():
            rights &= _OF_FILES
        rule = struct.pack("=Qi", rights, at)
        libc.syscall(_ADD_RULE, rules, _RULE_PATH_BENEATH, rule, 0)
    finally:
        os.close(at)


def _refuse_calls(libc: ctypes.CDLL) -> bool:
    """A filter of system calls; the program of it is in classic BPF, eight bytes a step."""
    machine = platform.machine()
    if machine not in _REFUSED:
        return False
    architecture, refused = _REFUSED[machine]
    steps = [_step(0x20, 0, 0, 4), _step(0x15, 1, 0, architecture), _step(0x06, 0, 0, _KILL)]
    steps.append(_step(0x20, 0, 0, 0))  # the call's number
    tests = [_step(0x35, len(refused) + 1, 0, _X32)]
    tests += [_step(0x15, len(refused) - k, 0, number) for k, number in enumerate(refused)]
    steps += [*tests, _step(0x06, 0, 0, _ALLOW), _step(0x06, 0, 0, _ERROR_EPERM)]
    code = ctypes.create_string_buffer(b"".join(steps))
    program = struct.pack("@HP", len(steps), ctypes.addressof(code))
    return bool(libc.prctl(_SET_SECCOMP, _FILTER, program, 0, 0) == 0)


def _step(code: int, if_true: int, if_false: int, value: int) -> bytes:
    return struct.pack("=HBBI", code, if_true, if_false, value)
