"""The subcommands of `gi-log`, one file each: `register` adds its parser, `run` carries it out."""
