"""Experiments on recordings and virtual sensors, shared by benchmarks (print) and tests (assert).

Imports the package and its plugins, but neither tests nor benchmarks.
"""
