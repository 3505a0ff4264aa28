"""OpenCV comes in four packages that share one folder, so that two of them break each other."""

from __future__ import annotations

from importlib import import_module

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
