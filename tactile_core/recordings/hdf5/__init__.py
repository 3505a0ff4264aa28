"""Recordings and readings in one HDF5 file, which can be read while it is written."""
