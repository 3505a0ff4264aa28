"""Hooks whose import has an effect of its own."""

import tempfile
from pathlib import Path

from fake_faulty.hooks import Hooks

with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "cache").write_text("cached")
plugin = Hooks(estimators="Sound")
