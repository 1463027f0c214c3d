"""The edge loop: perception, decision, robot client, safety. Imports neither torch, onnx nor pybullet."""
