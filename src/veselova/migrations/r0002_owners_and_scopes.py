"""Keys have a scope, an owner and an end; jobs and idempotency keys belong to an owner.

Keys that were made before may solve, and own nothing yet: the jobs of that time belong to nobody.
"""

from __future__ import annotations

from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"

_IDEMPOTENCY_KEYS = sa.table(
    "idempotency_keys",
    sa.column("owner", sa.String),
    sa.column("key", sa.String),
    sa.column("job_id", sa.String),
    sa.column("created_at", sa.DateTime(timezone=True)),
)


def upgrade() -> None:
    """Add the columns, and make the table of idempotency keys again, whose primary
    key is another.
    """
    op.add_column(
        "api_keys", sa.Column("scope", sa.String(16), nullable=False, server_default="solve")
    )
    op.add_column("api_keys", sa.Column("owner", sa.String(16), nullable=False, server_default=""))
    op.add_column("api_keys", sa.Column("expires_at", sa.DateTime(timezone=True)))
    op.execute(sa.text("UPDATE api_keys SET owner = id"))
    op.add_column("jobs", sa.Column("owner", sa.String(16), nullable=False, server_default=""))
    connection = op.get_bind()
    now = datetime.now(UTC)
    rows = [
        row._asdict()
        for row in connection.execute(sa.text("SELECT key, job_id FROM idempotency_keys"))
    ]
    op.drop_table("idempotency_keys")
    op.create_table(
        "idempotency_keys",
        sa.Column("owner", sa.String(16), primary_key=True),
        sa.Column("key", sa.String(255), primary_key=True),
        sa.Column(
            "job_id",
            sa.String(32),
            sa.ForeignKey("jobs.id", ondelete="CASCADE", deferrable=True, initially="DEFERRED"),
            nullable=False,
        ),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
    )
    if rows:
        connection.execute(
            sa.insert(_IDEMPOTENCY_KEYS), [{**row, "owner": "", "created_at": now} for row in rows]
        )


def downgrade() -> None:
    """Take the columns away again; idempotency keys of owners are forgotten."""
    connection = op.get_bind()
    rows = [
        row._asdict()
        for row in connection.execute(
            sa.text("SELECT key, job_id FROM idempotency_keys WHERE owner = ''")
        )
    ]
    op.drop_table("idempotency_keys")
    op.create_table(
        "idempotency_keys",
        sa.Column("key", sa.String(255), primary_key=True),
        sa.Column(
            "job_id", sa.String(32), sa.ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False
        ),
    )
    if rows:
        connection.execute(sa.insert(_IDEMPOTENCY_KEYS), rows)
    for table, column in (
        ("jobs", "owner"),
        ("api_keys", "expires_at"),
        ("api_keys", "owner"),
        ("api_keys", "scope"),
    ):
        op.drop_column(table, column)
