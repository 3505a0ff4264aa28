"""Hooks whose import has an effect of its own."""

import os

from fake_faulty.hooks import Hooks

os.environ["FAKE_FAULTY"] = "imported"
plugin = Hooks(estimators="Sound")
