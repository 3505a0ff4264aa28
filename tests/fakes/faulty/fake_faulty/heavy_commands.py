"""A command whose module imports a heavy package."""

import cv2


def greet() -> None:
    """Print the version of OpenCV."""
    print(cv2.__version__)
