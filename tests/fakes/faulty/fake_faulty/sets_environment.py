"""Hooks whose import has an effect of its own."""

import os

from fake_faulty.hooks import Hooks

os.environ["OPENCV_LOG_LEVEL"] = "OFF"
plugin = Hooks(estimators="Sound")
