"""From torch to ONNX: export, parity checks, and the manifest of a model bundle."""
