"""Measurements of the project itself: against the truth, and against the clock.

May import every room but cli and testing.
"""
