"""Matrix groups, and the distributions that constraints define on them."""
