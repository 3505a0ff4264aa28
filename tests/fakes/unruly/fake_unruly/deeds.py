"""What an unruly part can do."""

from __future__ import annotations

import os
import signal
import sys
import time
import warnings

from tactile_core.errors import InputError

RAISED: dict[str, BaseException] = {
    "end of file": EOFError(),
    "broken pipe": BrokenPipeError(32, "Broken pipe"),
    "value": ValueError("the weights do not fit"),
    "memory": MemoryError(),
    "interrupt": KeyboardInterrupt(),
    "stop": StopIteration(),
    "key": KeyError("weights"),
    "disk": OSError(28, "No space left on device", "weights.npz"),
    "refusal": InputError("the gel is upside down"),
}


def do(deed: str) -> None:
    """Do it; nothing, where it is a fault of what is returned."""
    if deed in RAISED:
        raise RAISED[deed]
    if deed == "exit":
        sys.exit(0)
    if deed == "recursion":
        do(deed)
    if deed == "chatter":
        print("a word from the plugin")
        os.write(1, b"a word from its driver\n")
        warnings.warn("a word from its library", UserWarning, stacklevel=1)
    if deed in ("SIGINT", "SIGTERM", "SIGHUP"):
        os.kill(os.getpid(), getattr(signal, deed))
        time.sleep(5)
