"""What a reading leaves on disk: arrays, height maps, pictures and meshes that others open."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.printable import printable
from tactile_core.plugins.blame import blame
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Gradients,
    HeightMap,
    MarkerField,
)
from tactile_core.recordings.output_folder import OutputFolder

if TYPE_CHECKING:
    from tactile_core.pipeline.reading import Reading

_ENDINGS = {"npz": (".npz",), "tmd": (".tmd",), "png": (".png", "_normals.png"), "ply": (".ply",)}
FORMATS = tuple(_ENDINGS)

_LONGEST_STEM = 200
_UNSAFE = re.compile(r"[/\\\x00-\x1f\x7f-\x9f]")


def write_reading(
    reading: Reading, directory: OutputFolder | Path, formats: Collection[str]
) -> list[Path]:
    """Write one reading under the name of its observation.

    Parameters
    ----------
    reading : Reading
        Formats that need what it lacks (a height map, slopes) are left out.
    directory : OutputFolder or Path
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
        The directory is a file, a format is unknown, or there is a file of such a name that no
        command wrote, or that was written for another observation.
    OSError
        The disk is full or refuses; no file is left half-written.
    """
    unknown = sorted(set(formats) - set(FORMATS))
    if unknown:
        raise InputError(f"{unknown[0]!r} is no output format; choose among {', '.join(FORMATS)}")
    folder = directory if isinstance(directory, OutputFolder) else OutputFolder(directory)
    stem, written = safe_stem(reading.source), []
    for ending, writer in _writers(reading, formats):
        written.append(folder.write(stem + ending, writer, of=reading.source))
    return written


def check_names(folder: OutputFolder, sources: Iterable[str], formats: Collection[str]) -> None:
    """Refuse, before anything is measured, what could not be written in the end.

    Raises
    ------
    InputError
        Results of two observations would have one name, or a file of such a name is there that no
        command wrote.
    """
    owners: dict[str, str] = {}
    for source in sources:
        stem = safe_stem(source)
        for name in (stem + ending for format in formats for ending in _ENDINGS[format]):
            if name in owners:
                raise InputError(
                    f"results of {printable(owners[name])} and of {printable(source)} would both "
                    f"be {printable(name)}; rename one of these inputs, or measure them apart"
                )
            owners[name] = source
    folder.check(owners)


def safe_stem(source: str) -> str:
    """Return the name of an observation as a name of files; changed ones get a fingerprint."""
    stem = _UNSAFE.sub("_", source)
    try:
        short = os.fsencode(stem)[:_LONGEST_STEM].decode("utf-8", "ignore")
        stem = stem if len(os.fsencode(stem)) <= _LONGEST_STEM else short
    except UnicodeEncodeError:  # no file can be called so
        stem = stem.encode("ascii", "replace").decode().replace("?", "_")[:_LONGEST_STEM]
    if stem == source and stem not in ("", ".", ".."):
        return stem
    mark = hashlib.sha256(source.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{stem.strip('.')}-{mark}"


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


def _writers(
    reading: Reading, formats: Collection[str]
) -> Iterator[tuple[str, Callable[[Path], None]]]:
    """Ending of each file, and what writes it."""
    from tactile_core.formats.images import write_png
    from tactile_core.formats.normals import write_normals
    from tactile_core.formats.npz import write_npz
    from tactile_core.formats.ply import write_ply
    from tactile_core.formats.tmd import write_tmd

    height, gradients = reading.get(HeightMap), reading.get(Gradients)
    if "npz" in formats:
        yield ".npz", partial(write_npz, arrays=merged_arrays(reading))
    if height is not None and "tmd" in formats:
        mm = _finite(height.mm)
        yield ".tmd", partial(write_tmd, height_mm=mm, mm_per_px=height.mm_per_px)
    picture = _picture(reading) if "png" in formats else None
    if picture is not None:
        yield ".png", partial(write_png, pixels=picture)
    if gradients is not None and "png" in formats:
        normals = _finite(gradients.normals, fill=(0.0, 0.0, 1.0))
        yield "_normals.png", partial(write_normals, normals=normals)
    if height is not None and "ply" in formats:
        points_mm = replace(height, mm=_finite(height.mm)).points_mm
        yield ".ply", partial(write_ply, points_mm=points_mm)


def _picture(reading: Reading) -> NDArray[np.uint8] | None:
    """What the reading has to show: height, how the skin is dragged, or the marks alone."""
    from tactile_core.views.pictures import dragged, marked, relief, side_by_side

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


def _finite(array: NDArray[Any], fill: float | tuple[float, ...] = 0.0) -> NDArray[Any]:
    good = np.isfinite(array)
    if good.all():
        return array
    if isinstance(fill, tuple):
        good = good.all(axis=-1, keepdims=True)
    return np.asarray(np.where(good, array, np.asarray(fill, array.dtype)))
