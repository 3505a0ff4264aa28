"""The calibration of one physical unit, as a folder that belongs to it.

May import profiles, plugins, interfaces and what these may import.
"""
