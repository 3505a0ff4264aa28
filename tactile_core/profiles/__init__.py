"""Profiles: YAML with positions, the model, and every mistake at once.

May import plugins, interfaces and what these may import.
"""
