"""Conditioning of frames before measurement: sequence check, marker mask, light drift.

May import bundles, profiles, plugins, interfaces and what these may import.
"""
