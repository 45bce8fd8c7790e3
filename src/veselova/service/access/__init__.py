"""Keys, their database, and the middleware that asks for them."""
