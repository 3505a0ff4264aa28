"""Profiles: YAML with positions, the data model, and validation that reports every mistake.

May import plugins, interfaces and what these may import.
"""
