"""A command whose module prints, as code beyond Python prints."""

import os

os.write(1, b"welcome to the command")


def greet() -> None:
    """Greet nobody."""
