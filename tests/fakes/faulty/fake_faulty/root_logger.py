"""Hooks whose import has an effect of its own."""

import logging

from fake_faulty.hooks import Hooks

logging.basicConfig(level=logging.DEBUG)
plugin = Hooks(estimators="Sound")
