"""Pure functions on arrays; they know nothing else of ours but ``errors``."""
