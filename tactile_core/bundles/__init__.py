"""The calibration bundle of one physical unit: a folder with its models and its reference.

May import profiles, plugins, interfaces and what these may import.
"""
