"""A job has the bytes that were promised to it, and those that it took once it has ended; 0 stands
for not counted yet.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Add the column."""
    op.add_column("jobs", sa.Column("bytes", sa.BigInteger, nullable=False, server_default="0"))


def downgrade() -> None:
    """Take the column away."""
    op.drop_column("jobs", "bytes")
