"""One problem from its torus to states at given times, with a bound of their error."""
