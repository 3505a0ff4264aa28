"""File formats, one module each: read into plain values and written atomically.

May import algorithms, quantities and errors.
"""
