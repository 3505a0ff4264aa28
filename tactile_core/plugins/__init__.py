"""Installed plugins: found by metadata, imported where they are named, blamed where they fail.

May import interfaces and what that may import.
"""
