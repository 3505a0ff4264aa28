"""Recordings and readings in one HDF5 file, which is written from finished recordings."""
