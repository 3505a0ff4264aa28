"""From presses of something known to a fitted model, scored on what was held out, in a bundle.

May import pipeline and what that may import.
"""
