"""Networks in ONNX files as estimators: manifest, input, and the libraries that run them."""
