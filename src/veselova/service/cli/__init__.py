"""The command line, and sweeps without a server."""
