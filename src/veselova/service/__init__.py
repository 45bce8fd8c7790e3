"""The doors: HTTP API, its client, and the command line."""
