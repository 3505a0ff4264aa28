"""What a reading leaves on disk: arrays, height maps, pictures and meshes that others open."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.blame import blame
from tactile_core.errors import InputError
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Gradients,
    HeightMap,
    MarkerField,
)

if TYPE_CHECKING:
    from tactile_core.reading import Reading

FORMATS = ("npz", "tmd", "png", "ply")


def write_reading(reading: Reading, directory: Path, formats: Collection[str]) -> list[Path]:
    """Write one reading under the name of its observation.

    Parameters
    ----------
    reading : Reading
        Formats that need what it lacks (a height map, slopes) are left out.
    directory : Path
        Made where it does not exist.
    formats : collection of str
        Among ``npz`` (all arrays), ``tmd`` (height), ``png`` (a picture, and ``NAME_normals.png``)
        and ``ply`` (a mesh).

    Returns
    -------
    list of Path
        The files written, each of them whole.

    Raises
    ------
    InputError
        The directory is a file, or a format is unknown.
    OSError
        The disk is full or refuses; no file is left half-written.
    """
    unknown = sorted(set(formats) - set(FORMATS))
    if unknown:
        raise InputError(f"{unknown[0]!r} is no output format; choose among {', '.join(FORMATS)}")
    directory = Path(directory)
    if directory.exists() and not directory.is_dir():
        raise InputError(f"{directory} is a file; name a folder for the results")
    directory.mkdir(parents=True, exist_ok=True)
    stem = directory / reading.source
    written: list[Path] = []
    if "npz" in formats:
        written.append(_write_npz(reading, stem))
    height = reading.get(HeightMap)
    if height is not None and "tmd" in formats:
        from tactile_core.formats.tmd import write_tmd

        written.append(_beside(stem, ".tmd"))
        write_tmd(written[-1], _finite(height.mm), height.mm_per_px)
    if "png" in formats:
        written += _write_pictures(reading, stem)
    if height is not None and "ply" in formats:
        from tactile_core.formats.ply import write_ply

        written.append(_beside(stem, ".ply"))
        write_ply(written[-1], replace(height, mm=_finite(height.mm)).points_mm)
    return written


def merged_arrays(reading: Reading) -> Mapping[str, NDArray[Any]]:
    """Return the arrays of all of a reading's quantities, finite everywhere.

    What is not finite becomes 0 and is marked in ``valid``. Two quantities' arrays of one name are
    told apart by the second one's type: ``Type.name``.
    """
    # the height map's `valid` is the one that is meant where there are two
    ours = [q for kind in (HeightMap, Gradients) if (q := reading.get(kind)) is not None]
    others = [q for q in reading.quantities.values() if all(q is not mine for mine in ours)]
    merged: dict[str, NDArray[Any]] = {}
    for quantity in [*ours, *others]:
        with blame(f"the quantity {type(quantity).__name__}", quantity):
            arrays = {str(name): np.asarray(array) for name, array in quantity.arrays().items()}
        for name, array in arrays.items():
            if name not in merged:
                merged[name] = array
            elif not (isinstance(quantity, Gradients) and name == "valid"):
                merged[f"{type(quantity).__name__}.{name}"] = array
    merged.setdefault("mm_per_px", np.asarray(reading.frame.mm_per_px))
    valid = merged.get("valid")
    for name, array in merged.items():
        if not np.issubdtype(array.dtype, np.floating) or np.isfinite(array).all():
            continue
        merged[name] = _finite(array)
        if valid is not None and array.shape[:2] == valid.shape:
            holes = ~np.isfinite(array).reshape(*valid.shape, -1).all(axis=2)
            merged["valid"] = valid = valid & ~holes
    return merged


def _write_npz(reading: Reading, stem: Path) -> Path:
    from tactile_core.formats.npz import write_npz

    path = _beside(stem, ".npz")
    write_npz(path, merged_arrays(reading))
    return path


def _write_pictures(reading: Reading, stem: Path) -> list[Path]:
    from tactile_core.formats.images import write_png
    from tactile_core.formats.normals import write_normals

    written = []
    gradients, picture = reading.get(Gradients), _picture(reading)
    if picture is not None:
        written.append(_beside(stem, ".png"))
        write_png(written[-1], picture)
    if gradients is not None:
        written.append(_beside(stem, "_normals.png"))
        write_normals(written[-1], _finite(gradients.normals, fill=(0.0, 0.0, 1.0)))
    return written


def _picture(reading: Reading) -> NDArray[np.uint8] | None:
    """What the reading has to show: height, how the skin is dragged, or the marks alone."""
    from tactile_core.pictures import dragged, marked, relief, side_by_side

    height, contact = reading.get(HeightMap), reading.get(ContactMask)
    markers, field = reading.get(MarkerField), reading.get(DisplacementField)
    sheets = {}
    if height is not None:
        clean = HeightMap(_finite(height.mm), height.valid, height.mm_per_px)
        sheets["height"] = relief(
            clean, contact, markers=markers, field=field, title=reading.source
        )
    if field is not None:
        clean_field = replace(field, mm=_finite(field.mm))
        sheets["displacement"] = dragged(
            clean_field, contact, markers=markers, title="" if sheets else reading.source
        )
    if len(sheets) > 1:
        return side_by_side(list(sheets.values()), list(sheets))
    if not sheets and markers is not None:
        return marked(reading.frame, markers, title=reading.source)
    return next(iter(sheets.values()), None)


def _beside(stem: Path, ending: str) -> Path:
    # not with_suffix: a name may have dots of its own
    return stem.with_name(stem.name + ending)


def _finite(array: NDArray[Any], fill: float | tuple[float, ...] = 0.0) -> NDArray[Any]:
    good = np.isfinite(array)
    if good.all():
        return array
    if isinstance(fill, tuple):
        good = good.all(axis=-1, keepdims=True)
    return np.asarray(np.where(good, array, np.asarray(fill, array.dtype)))
