"""Worker processes that have imported everything and forked for each case."""

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

from fuzz.hunt import Case, Result, hunt, try_case

_corpus: Path | None = None
_MEMORY_BYTES = 4 << 30
_UNWANTED = ("tactile_core.testing", "tactile_core.cli.__main__")


def crew(workers: int, folder: Path) -> ProcessPoolExecutor:
    """Start workers; each makes good inputs for itself below the folder."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    return ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=_prepare, initargs=(folder,)
    )


def try_one(case: Case, keep: Path | None = None) -> Result:
    """Try, in a worker, one case."""
    return try_case(case, _good_inputs(), keep)


def try_some(area: str, numbers: range, seed: int) -> list[Result]:
    """Try, in a worker, cases that may grow from one another."""
    results: list[Result] = []
    hunt(area, numbers, seed, _good_inputs(), results.append)
    return results


def _good_inputs() -> Path:
    """This worker's good inputs."""
    if _corpus is None:
        raise RuntimeError("only a worker has good inputs")
    return _corpus


def _prepare(folder: Path) -> None:
    global _corpus
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, resource.RLIM_INFINITY))
    import tactile_core

    for module in walk_packages(tactile_core.__path__, "tactile_core."):
        if not module.name.startswith(_UNWANTED) and ".kernels." not in module.name:
            import_module(module.name)
    import cv2
    from fuzz.corpus import make_corpus

    cv2.setNumThreads(1)  # a pool of threads does not survive a fork
    place = Path(tempfile.mkdtemp(prefix="worker-", dir=folder)) / "corpus"
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        _corpus = make_corpus(place)
        _warm_up(place)
    # decoders print what they think of the images that are about to be spoilt a second time
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def _warm_up(corpus: Path) -> None:
    """Import what commands import late, so that no case pays for it."""
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
