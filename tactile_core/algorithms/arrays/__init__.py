"""Building blocks of the image algorithms: array types, resizing, statistics and regression."""
