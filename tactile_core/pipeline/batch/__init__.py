"""Many recordings through one pipeline: in this process, in several, or on a cluster."""
