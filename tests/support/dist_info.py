"""Makes a project importable and visible to metadata like an installation, without network."""

from __future__ import annotations

import tomllib
from pathlib import Path


def write_dist_info(project: Path, site: Path) -> None:
    """Write the ``*.dist-info`` that installing ``project`` would leave in ``site``.

    Parameters
    ----------
    project : Path
        A folder with a ``pyproject.toml``.
    site : Path
        An existing folder; put it on ``sys.path`` together with ``project``.
    """
    table = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    folder = site / f"{table['name'].replace('-', '_')}-{table['version']}.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {table['name']}\nVersion: {table['version']}\n",
        encoding="utf-8",
    )
    lines = []
    for group, entries in table.get("entry-points", {}).items():
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in entries.items())]
    (folder / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
