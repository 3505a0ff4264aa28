"""Entry points of installed plugins, and what else is installed."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import Distribution


_API_GROUP = re.compile(r"tactile_core\.v\d+")


@dataclass(frozen=True)
class Offer:
    """A plugin that a distribution's metadata declares.

    Attributes
    ----------
    name : str
        The plugin's name, or the distribution's if its entry points cannot be read.
    value : str
        ``"module"`` or ``"module:object"``.
    group : str
        The entry-point group, ``tactile_core.v1`` for this API.
    distribution, version : str
        The distribution that declares it.
    problem : str
        Why the metadata cannot be used; empty if it can.
    """

    name: str
    value: str
    group: str
    distribution: str
    version: str
    problem: str = ""

    @property
    def origin(self) -> str:
        """The distribution and its version."""
        return f"{self.distribution} {self.version}"

    def __str__(self) -> str:
        return f"plugin {self.name!r} ({self.origin})"


def installed_offers() -> tuple[Offer, ...]:
    """Return the plugins that installed distributions declare, for this and other API groups.

    Takes about a millisecond; the result is cached until ``sys.path`` or a folder on it changes.
    """
    return _scan(tuple((entry, _modified_ns(entry)) for entry in sys.path))


def normalize_name(distribution: str) -> str:
    """Return a distribution's name in the normalized form of package indexes."""
    return re.sub(r"[-_.]+", "-", distribution).lower()


def _modified_ns(entry: str) -> int:
    try:
        return Path(entry or ".").stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=1)
def _scan(path_state: tuple[tuple[str, int], ...]) -> tuple[Offer, ...]:
    # imported late, because the import takes longer than the scan
    from importlib.metadata import distributions

    offers: dict[str, tuple[Offer, ...]] = {}
    for distribution in distributions():
        found = tuple(_offers(distribution))
        if found:
            # Python imports the first one on sys.path
            offers.setdefault(normalize_name(found[0].distribution), found)
    return tuple(offer for found in offers.values() for offer in found)


def _offers(distribution: Distribution) -> Iterator[Offer]:
    try:
        text = distribution.read_text("entry_points.txt") or ""
    except (OSError, ValueError):
        # damaged metadata of an unrelated distribution, as far as we can know
        return
    if "tactile_core." not in text:
        return
    metadata = distribution.metadata
    name = str(metadata["Name"] or "(unnamed)")
    version = str(metadata["Version"] or "(no version)")
    try:
        entries = list(distribution.entry_points)
    except Exception as error:  # importlib.metadata passes on any exception of its parser
        yield Offer(
            name, "", "", name, version, f"its entry_points.txt cannot be read ({error}); reinstall"
        )
        return
    for entry in entries:
        if _API_GROUP.fullmatch(entry.group):
            yield Offer(entry.name, entry.value, entry.group, name, version)


_PACKAGES = (
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
    "opencv-python",
    "opencv-python-headless",
)
_WANTED = "opencv-contrib-python-headless"


def opencv_fault() -> str:
    """Return what is wrong with the installed OpenCV, and the remedy; empty if it is sound."""
    from importlib.metadata import distributions

    try:
        broken = not hasattr(import_module("cv2"), "imdecode")
    except (ImportError, AttributeError):
        broken = True
    names = {str(one.metadata["Name"]).lower().replace("_", "-") for one in distributions()}
    installed = sorted(names.intersection(_PACKAGES))
    if not broken and len(installed) < 2:
        return ""
    if broken:
        what = "OpenCV cannot be imported; removing one of its packages takes files from another"
    else:
        what = f"{' and '.join(installed)} are both installed, and each overwrites files of another"
    remedy = f"pip install --force-reinstall --no-deps {_WANTED}"
    if installed and installed != [_WANTED]:
        remedy = f"pip uninstall -y {' '.join(installed)}' and '{remedy}"
    return f"{what}; run '{remedy}'"


def opencv_fault_behind(error: BaseException) -> str:
    """Return the fault of OpenCV if that caused an error, also through what it loads."""
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, ImportError | AttributeError) and _passes_cv2(seen):
            return opencv_fault()
        seen = seen.__cause__ or seen.__context__
    return ""


def _passes_cv2(error: BaseException) -> bool:
    if "cv2" in str(error):
        return True
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_globals.get("__name__", "").partition(".")[0] == "cv2":
            return True
        trace = trace.tb_next
    return False


def library_versions() -> dict[str, str]:
    """Return the versions of this package, Python and the libraries that compute."""
    import platform

    import cv2
    import numpy
    import scipy

    from tactile_core import __version__

    libraries = {"numpy": numpy, "scipy": scipy, "opencv": cv2}
    found = {name: str(library.__version__) for name, library in libraries.items()}
    return {"tactile-core": __version__, "python": platform.python_version(), **found}
