"""Algorithms as pure functions on arrays, one module or package per topic.

May import errors, and no other package of the project.
"""
