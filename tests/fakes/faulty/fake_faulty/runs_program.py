"""Hooks whose import has an effect of its own."""

import subprocess
import sys

from fake_faulty.hooks import Hooks

subprocess.run([sys.executable, "-c", ""], check=True)
plugin = Hooks(estimators="Sound")
