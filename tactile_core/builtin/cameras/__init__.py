"""Cameras: webcams, streams on the network, and images in a folder."""
