"""Regression of measured forces on features of readings, and the checks of what was measured."""
