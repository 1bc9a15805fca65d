"""The subcommands of `livebode fleet`."""
