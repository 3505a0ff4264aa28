"""Helpers for the files of bundles."""

import json
from pathlib import Path


def edit(bundle: Path, **changes: object) -> None:
    path = bundle / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def held(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files in a folder, including hidden ones."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
