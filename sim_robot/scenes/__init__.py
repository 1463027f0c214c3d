"""The twelve reference arrangements, as scene files."""
