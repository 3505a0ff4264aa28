"""Recordings as MCAP files, which Foxglove and rerun open: writing, reading and recovering."""
