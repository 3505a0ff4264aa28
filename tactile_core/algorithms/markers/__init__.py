"""Printed markers: contrast, mask, centroids, the lattice, and identities that are kept."""
