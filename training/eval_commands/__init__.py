"""The subcommands of `gi-eval`, a module each with `register`."""
