"""Vector fields, each written once over floats or symbols, and the manifolds that they preserve."""
