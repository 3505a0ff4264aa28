"""Slopes from intensities: samples, features, models on a grid, networks, tables."""
