"""Recordings as folders of images, exactly as the camera sent them, beside a list of them."""
