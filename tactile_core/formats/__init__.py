"""File formats: one module each, reading into plain values and writing whole or not at all."""
