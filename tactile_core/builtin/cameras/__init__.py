"""Cameras: webcams, GenICam and DSLR cameras, streams on the network, and images in a folder."""
