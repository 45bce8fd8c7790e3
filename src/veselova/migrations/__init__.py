"""Changes of the database's tables, one file each; Alembic runs those that a database has not seen,
in their order.
"""
