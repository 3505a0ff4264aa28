"""In-plane displacement of the gel surface: dense fields and their decomposition."""
