"""Reads recordings as observations, and writes result folders without touching the user's files.

May import bundles, profiles, plugins, interfaces and what these may import.
"""
