"""Profiles: YAML with positions, the model, and every mistake at once."""
