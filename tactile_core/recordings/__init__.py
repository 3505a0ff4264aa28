"""Files as observations, and folders of results that leave the files of the user alone.

May import bundles, profiles, plugins, interfaces and what these may import.
"""
