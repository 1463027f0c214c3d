"""The project's own protobuf messages; `make proto` writes the `_pb2` modules again."""
