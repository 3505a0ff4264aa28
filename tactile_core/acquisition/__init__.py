"""Acquires frames: switches the lights, reads the camera, and rectifies and stacks its images.

May import bundles, profiles, plugins, interfaces and what these may import.
"""
