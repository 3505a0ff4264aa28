"""Hooks whose import has an effect of its own."""

import cv2  # noqa: F401

from fake_faulty.hooks import Hooks

plugin = Hooks(estimators="Sound")
