"""Pictures and pages: what people look at.

May import formats, algorithms, quantities and errors.
"""
