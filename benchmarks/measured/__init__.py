"""Accuracy on real recordings, row by row of one table; ``accuracy.py`` prints it.

Each row is measured through the public chain with the shipped defaults. What a row is tested on was
not fitted on, or the row says otherwise; of two directions the worse one counts.
"""
