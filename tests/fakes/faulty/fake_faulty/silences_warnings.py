"""Hooks whose import has an effect of its own."""

import warnings

from fake_faulty.hooks import Hooks

warnings.simplefilter("ignore")
plugin = Hooks(estimators="Sound")
