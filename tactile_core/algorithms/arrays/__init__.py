"""What image algorithms share: types of arrays, and what is done to any image or set of samples."""
