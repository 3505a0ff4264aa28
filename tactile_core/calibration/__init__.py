"""Fit a calibration to presses on a calibration target, score it on held-out presses, bundle it.

May import pipeline and what that may import.
"""
