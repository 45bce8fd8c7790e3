"""The closed-form engine: curve, periods, Abel–Jacobi inversion, theta functions, frame and clock."""
