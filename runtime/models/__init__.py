"""The model bundle that ships with the package (ONNX files and their manifest)."""
