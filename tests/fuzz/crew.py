"""Worker processes with all imports done, which fork for each case."""

from __future__ import annotations

import io
import os
import resource
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout, suppress
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from pkgutil import walk_packages
from typing import TYPE_CHECKING

from tactile_core.pipeline.one_thread import ONE_THREAD

if TYPE_CHECKING:
    from fuzz.hunt import Case, Result

_corpus: Path | None = None
_MEMORY_BYTES = 4 << 30
_UNWANTED = ("tactile_core.testing", "tactile_core.cli.__main__")


def crew(workers: int, folder: Path) -> ProcessPoolExecutor:
    """Start workers; each creates its own valid inputs below the folder."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
    return ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_prepare, initargs=(folder,)
    )


def try_one(case: Case, keep: Path | None = None) -> Result:
    """Run one case in a worker."""
    from fuzz.hunt import try_case

    return try_case(case, _good_inputs(), keep)


def try_some(area: str, numbers: range, seed: int) -> list[Result]:
    """Run cases in a worker; later ones can extend earlier ones."""
    from fuzz.hunt import hunt

    results: list[Result] = []
    hunt(area, numbers, seed, _good_inputs(), results.append)
    return results


def _good_inputs() -> Path:
    """Return this worker's valid inputs."""
    if _corpus is None:
        raise RuntimeError("only a worker has valid inputs")
    return _corpus


def _prepare(folder: Path) -> None:
    global _corpus
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, resource.RLIM_INFINITY))
    import tactile_core
    from tactile_core.cli import main

    with redirect_stdout(io.StringIO()), suppress(SystemExit):
        main(["--version"])  # sets the environment that libraries read when they are imported
    for module in walk_packages(tactile_core.__path__, "tactile_core."):
        if not module.name.startswith(_UNWANTED):
            with suppress(ModuleNotFoundError):  # of an extra that is not installed
                import_module(module.name)
    import cv2
    from fuzz.corpus import make_corpus

    cv2.setNumThreads(1)  # a pool of threads does not survive a fork
    place = Path(tempfile.mkdtemp(prefix="worker-", dir=folder)) / "corpus"
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        _corpus = make_corpus(place)
        _warm_up(place)
    # silences the decoders when a corrupted image is mutated again
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def _warm_up(corpus: Path) -> None:
    """Run the lazy imports of commands, so that no case spends time on them."""
    from fuzz import recipes

    from tactile_core.cli import main

    here = Path.cwd()
    os.chdir(corpus)
    try:
        for words in (recipes.RUN_IMAGE, recipes.RUN_MARKED, recipes.VALIDATE):
            words = [word if word != "out" else str(corpus.parent / "out") for word in words]
            with suppress(SystemExit):
                main(words)
    finally:
        os.chdir(here)
        sys.stdout.flush()
