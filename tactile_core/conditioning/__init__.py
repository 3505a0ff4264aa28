"""What happens to a frame once, before anything is measured from it.

May import bundles, profiles, plugins, interfaces and what these may import.
"""
