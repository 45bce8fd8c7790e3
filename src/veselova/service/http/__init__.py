"""The application, its routes, the protocol and the server."""
