"""Finds plugins by their metadata, imports them on use, and attributes their failures to them.

May import interfaces and what that may import.
"""
