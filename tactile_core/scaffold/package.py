"""Template of a plugin package around a new profile, installable and with a passing test."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text, remove_leftovers, write_together
from tactile_core.formats.folders import fresh_folder, make_folder, move_in
from tactile_core.recordings.inputs import Inputs
from tactile_core.scaffold.profile import NewProfile, refuse_existing

STEP = "deepest"  # Name of the template's estimator, and of its step in the profile

_PYPROJECT = """\
[build-system]
requires = ["hatchling>=1.24"]
build-backend = "hatchling.build"

[project]
name = "{distribution}"
version = "0.1.0"
description = "The tactile sensor {name} as a plugin of tactile-core"
readme = "README.md"
requires-python = ">=3.11"
dependencies = ["numpy>=1.26", "pydantic>=2.7,<3", "tactile-core>=0.1"]

[project.optional-dependencies]
test = ["pytest>=8"]

# The name on the left is the plugin's name, as in {name}.{step}.
[project.entry-points."tactile_core.v1"]
{name} = "{module}"

[tool.hatch.build.targets.wheel]
packages = ["{module}"]
"""

_README = """\
# {distribution}

The sensor `{name}` as a plugin of tactile-core: its profile
([{name}.yaml]({module}/profiles/{name}.yaml)) and an example estimator,
[{step}]({module}/{step}.py), which finds the deepest point.

```sh
pip install -e '.[test]'
pytest                     # the conformance test
tactile validate {name}
tactile calibrate {name} --presses presses/ --reference reference.png --ball-diameter-mm 4
tactile run {name} --input recording/ --out results --json
```

To add an estimator, add a module and a line in [__init__.py]({module}/__init__.py).
"""

_INIT = '''\
"""The plugin ``{name}``: its components and their import paths. Keep this module light."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Return the import path of each estimator."""
    return {{"{step}": "{module}.{step}:DeepestPoint"}}


@hookimpl
def tactile_profiles() -> Path:
    """Return the folder of the profiles."""
    return Path(__file__).parent / "profiles"
'''

_ESTIMATOR = '''\
"""The point of the deepest indentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import FieldSpec, HeightMap, Quantity, TimestampS

_DEEPEST = FieldSpec("mm", saved_as="deepest_mm")


@dataclass(frozen=True)
class Deepest(Quantity):
    """The deepest point, in the sensor frame.

    Attributes
    ----------
    x_mm, y_mm : float
        Position relative to the image centre, x right and y down; 0 without contact.
    depth_mm : float
        Indentation at that point; 0 without contact.
    """

    x_mm: Annotated[float, _DEEPEST]
    y_mm: Annotated[float, _DEEPEST]
    depth_mm: Annotated[float, _DEEPEST]
    timestamp_s: TimestampS = 0.0


class DeepestOptions(Options):
    """Options of ``{name}.{step}`` in a profile."""

    min_depth_mm: float = Field(
        default=0.05, ge=0, description="Smaller indentations count as noise, mm."
    )


class DeepestPoint(Estimator):
    """Finds the deepest point of a height map.

    The core places this step in the chain by the annotations of ``estimate``.
    """

    Options = DeepestOptions
    options: DeepestOptions

    def estimate(self, height: HeightMap) -> Deepest:
        """Return the deepest point of one height map."""
        rows, columns = height.mm.shape
        row, column = np.unravel_index(int(np.argmax(height.mm)), height.mm.shape)
        depth_mm = float(height.mm[row, column])
        if depth_mm < self.options.min_depth_mm:
            return Deepest(0.0, 0.0, 0.0, height.timestamp_s)
        x_mm = (float(column) - (columns - 1) / 2) * height.mm_per_px
        y_mm = (float(row) - (rows - 1) / 2) * height.mm_per_px
        return Deepest(x_mm, y_mm, depth_mm, height.timestamp_s)
'''

_TEST = """\
from tactile_core.testing import PluginConformance


class TestConformance(PluginConformance):
    plugin = "{name}"
    expected_failures = {{}}
"""


@dataclass(frozen=True)
class NewPackage:
    """A plugin package, ready to be written.

    Attributes
    ----------
    name : str
        Name of the plugin and of the profile.
    files : mapping of str to str
        Text of each file, by its path in the package's folder.
    inputs : Inputs
        Files that it was made from; they are never overwritten.
    """

    name: str
    files: Mapping[str, str]
    inputs: Inputs = field(default_factory=Inputs)

    def write(self, folder: Path, *, force: bool = False) -> None:
        """Write the package, completely or not at all.

        With ``force``, files of the same names in an existing folder are replaced, and no others.

        Raises
        ------
        InputError
            The folder exists, and ``force`` is False.
        """
        folder = Path(folder)
        refuse_existing(folder, force=force, folder=True)
        if folder.is_dir():
            self._write_over(folder)
            return
        with fresh_folder(folder) as fresh:
            for path, data in self._place_files(fresh).items():
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
            move_in(fresh, folder)

    def _place_files(self, folder: Path) -> dict[Path, bytes]:
        return {folder / name: text.encode("utf-8") for name, text in self.files.items()}

    def _write_over(self, folder: Path) -> None:
        placed = self._place_files(folder)
        for path in placed:
            if path.is_dir() or not path.parent.resolve().is_relative_to(folder.resolve()):
                raise InputError(
                    f"{path} is a folder or leads out of {folder}; move it away or give another "
                    f"--out"
                )
            self.inputs.refuse_file(path)
        remove_leftovers(folder)
        for path in placed:
            make_folder(path.parent)
        write_together(placed)


def profile_path(folder: Path, name: str) -> Path:
    """Return the path of the profile in the package's folder."""
    return folder / f"tactile_{name}" / "profiles" / f"{name}.yaml"


def new_package(profile: NewProfile) -> NewPackage:
    """Put a new profile into a plugin package of the same name.

    If the profile extends a file by its path, that file and those that it extends are copied.

    Raises
    ------
    InputError
        These files are in different folders, or one has the name of the new profile.
    """
    module = f"tactile_{profile.name}"
    fields = {
        "name": profile.name,
        "module": module,
        "distribution": module.replace("_", "-"),
        "step": STEP,
    }
    templates = {
        "pyproject.toml": _PYPROJECT,
        "README.md": _README,
        f"{module}/__init__.py": _INIT,
        f"{module}/{STEP}.py": _ESTIMATOR,
        "tests/test_conformance.py": _TEST,
    }
    files = {path: text.format(**fields) for path, text in templates.items()}
    files[f"{module}/py.typed"] = ""
    text = profile.text
    if profile.own_files:
        files.update(_copy_own_files(profile, f"{module}/profiles"))
        beside = f"./{profile.own_files[0].name}"
        text = text.replace(f"extends: {profile.extends}", f"extends: {json.dumps(beside)}", 1)
    files[f"{module}/profiles/{profile.name}.yaml"] = text + (
        f"\nestimators:\n  # The estimator of this package; '{STEP}: null' removes it.\n"
        f"  {STEP}: {{use: {profile.name}.{STEP}}}\n"
    )
    return NewPackage(profile.name, files, profile.inputs)


def _copy_own_files(profile: NewProfile, folder: str) -> dict[str, str]:
    """Return the texts of the files that a profile extends, by their paths in the package."""
    for path in profile.own_files:
        if path.parent.resolve() != profile.own_files[0].parent.resolve():
            raise InputError(
                f"{profile.own_files[0]} extends {path}, which is in another folder; copy it into "
                f"the same one, so that the package can hold both"
            )
        if path.name == f"{profile.name}.yaml":
            raise InputError(
                f"{path} would have the place of the new profile in the package; give the new "
                f"profile another name"
            )
    return {f"{folder}/{path.name}": read_text(path) for path in profile.own_files}
