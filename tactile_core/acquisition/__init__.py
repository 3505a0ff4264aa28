"""From the images of a camera, under its lights, to frames in the geometry of the profile.

May import bundles, profiles, plugins, interfaces and what these may import.
"""
