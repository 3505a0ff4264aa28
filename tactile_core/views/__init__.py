"""Pictures and HTML pages of measurements.

May import formats, algorithms, quantities and errors.
"""
