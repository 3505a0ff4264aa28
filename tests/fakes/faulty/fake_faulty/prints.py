"""Hooks whose import has an effect of its own."""

from fake_faulty.hooks import Hooks

print("welcome to the lab")
plugin = Hooks(estimators="Sound")
