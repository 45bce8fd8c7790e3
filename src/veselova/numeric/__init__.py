"""The numerical engine: integration on the manifold, with a measured error."""
