"""The application, its routes and the server."""
