"""Cameras that send images on their own: the reader thread, its queue and their base class."""
