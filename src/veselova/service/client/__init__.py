"""The Python client: requests, downloads, jobs on a server."""
