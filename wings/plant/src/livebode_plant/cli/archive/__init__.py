"""The subcommands of `livebode archive`."""
