"""File formats, one a module: read into plain values, written whole or not at all.

May import algorithms, quantities and errors.
"""
