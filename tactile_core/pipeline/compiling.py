"""Compiles kernels in a process of its own, so that no frame of a stream waits for them.

Compiling takes ten seconds or more and holds Python's lock, once per installation. Meanwhile
streams measure with numpy. A record then names the files of compiled code that a kind of work
needs, and the next stream loads these before its first frame.
"""

from __future__ import annotations

import atexit
import gc
import hashlib
import os
import pickle
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import IO

from tactile_core.algorithms import kernels
from tactile_core.formats.files import write_atomically

_PROGRAM = (
    "import pickle, sys; given = open(sys.argv[1], 'rb'); sys.path[:] = pickle.load(given); "
    "from tactile_core.pipeline.compiling import compile_given; compile_given(given)"
)
"""What the process runs. It imports from the folders that its parent imports from."""

_NICENESS = 5
"""Priority of the process: streams come first."""

_OBJECTS_BETWEEN_COLLECTIONS = 20_000
"""A compiler makes many objects that stay. With Python's own number the search for those that could
be released takes a tenth of its time; with this one its memory grows by a twentieth.
"""

_begun: dict[Path, subprocess.Popen[bytes]] = {}
"""The processes that this one has started, by their records."""


def already_compiled(kind: str, task: Callable[[], object]) -> bool:
    """Whether work can use kernels now; if it can later, begin to compile them elsewhere.

    ``TACTILE_FAST=1`` in the environment means to use them now, and to wait where one is needed
    that has not been compiled; ``TACTILE_FAST=0``, to use none.

    Parameters
    ----------
    kind : str
        What determines the types of the kernels' arguments.
    task : callable
        Calls every kernel that this kind of work needs, with arguments of these types; picklable.
        It runs in another process, which ends with this one.

    Returns
    -------
    bool
        False also where numba is missing, or no folder of caches is writable.
    """
    switch = os.environ.get(kernels.SWITCH)
    if switch == "0" or find_spec("numba") is None:
        return False
    if switch == "1":
        return kernels.load() is not None
    folder = _folder()
    if folder is None:
        return False
    record = folder / f"tactile-{_fingerprint(kind)}.txt"
    if _is_complete(record):
        return kernels.load() is not None
    if record not in _begun and all(process.poll() is not None for process in _begun.values()):
        _begin(record, task)
    return False


def _folder() -> Path | None:
    """Return the folder of the records: numba's if the environment names it, else the user's."""
    from platformdirs import user_cache_path

    given = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(given).absolute() if given else user_cache_path("tactile-core")
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    return folder if os.access(folder, os.W_OK) else None


def _fingerprint(kind: str) -> str:
    """Hash all that compiled code depends on, as far as that is known without importing numba."""
    numba, core = find_spec("numba"), Path(__file__).parents[1]
    assert numba is not None
    sources = [Path(numba.origin or ""), *sorted(core.glob("*/kernels/*.py"))]
    stamps = [(str(path), path.stat().st_mtime_ns) for path in sources]
    known = kind, stamps, sys.version, platform.node(), platform.machine()
    return hashlib.sha256(repr(known).encode()).hexdigest()[:16]


def _is_complete(record: Path) -> bool:
    try:
        return all(Path(name).exists() for name in record.read_text("utf-8").splitlines())
    except OSError:
        return False


def _begin(record: Path, task: Callable[[], object]) -> None:
    with suppress(OSError, pickle.PicklingError, AttributeError, TypeError):  # numpy is enough
        # a file: through a pipe, this process would wait until the other one reads
        with tempfile.NamedTemporaryFile(dir=record.parent, delete=False) as given:
            for part in (sys.path, record, task):
                pickle.dump(part, given)
        _begun[record] = process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, given.name],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            creationflags=getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0),  # Windows
        )
        atexit.register(_end, process)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.communicate()


def compile_given(given: IO[bytes]) -> None:
    """Do the task in a file, and record which files of compiled code belong to it.

    Parameters
    ----------
    given : binary file
        Holds the path of the record and the task; deleted.
    """
    Thread(target=_leave_with_parent, daemon=True).start()
    with given, suppress(OSError):
        record: Path = pickle.load(given)
        pickled = given.read()
        Path(given.name).unlink()
    if hasattr(os, "nice"):
        os.nice(_NICENESS)
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    with _turn(record.parent / "tactile.lock"):
        try:
            pickle.loads(pickled)()
        finally:  # what cannot be compiled here is compiled where it is needed
            write_atomically(record, "\n".join(_compiled_files()).encode())


def _leave_with_parent() -> None:
    # the parent never writes: its end of the pipe closes when it ends, however it ends
    os.read(0, 1)
    os._exit(1)


def _compiled_files() -> list[str]:
    """Return the files with the indices of what numba has compiled for this process."""
    rooms = [module for name, module in sys.modules.items() if name.endswith(".kernels.compiled")]
    every = [getattr(room, name) for room in rooms for name in room.__all__]
    folders = {kernel.stats.cache_path for kernel in every if kernel.signatures}
    return sorted(str(path) for folder in folders for path in Path(folder).glob("*.nbi"))


@contextmanager
def _turn(path: Path) -> Iterator[None]:
    """Wait for other processes that compile; the lock of one that is killed is released."""
    with path.open("w") as lock:
        if sys.platform == "win32":
            import msvcrt

            with suppress(OSError):  # after ten seconds
                msvcrt.locking(lock.fileno(), msvcrt.LK_LOCK, 1)
        else:
            import fcntl

            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
