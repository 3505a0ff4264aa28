"""The interfaces that plugins implement, and the sensor description that they receive.

May import views, formats, algorithms, quantities and errors.
"""
