"""The tables of version 0.14, with what those of 0.10 to 0.13 hold."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = None

#: Columns that old tables have, too.
_JOBS = "id, owner, request, state, detail, total, chunk_rows, bytes, created_at, finished_at"
_KEYS = "id, name, sha256, scope, owner, created_at, expires_at, revoked_at"


def upgrade() -> None:
    """Make the tables, and move the rows of the old ones into them. A job keeps one of its
    Idempotency-Keys.
    """
    is_old = sa.inspect(op.get_bind()).has_table("api_keys")
    if is_old:
        op.drop_index("ix_jobs_state", "jobs")
        op.rename_table("jobs", "old_jobs")
    _make_tables()
    if not is_old:
        return
    op.execute(
        f"INSERT INTO jobs ({_JOBS}, done, idempotency_key) SELECT {_JOBS}, "
        "CASE state WHEN 'finished' THEN total ELSE 0 END, "
        "(SELECT min(key) FROM idempotency_keys WHERE job_id = old_jobs.id) FROM old_jobs"
    )
    op.execute(f"INSERT INTO keys ({_KEYS}) SELECT {_KEYS} FROM api_keys")
    for name in ("idempotency_keys", "chunks", "old_jobs", "api_keys"):
        op.drop_table(name)


def _make_tables() -> None:
    moment = sa.DateTime(timezone=True)
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("owner", sa.String(16), nullable=False),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("request", sa.Text, nullable=False),
        sa.Column("state", sa.String(16), nullable=False, index=True),
        sa.Column("detail", sa.Text, nullable=False),
        sa.Column("total", sa.BigInteger, nullable=False),
        sa.Column("done", sa.BigInteger, nullable=False),
        sa.Column("chunk_rows", sa.Integer, nullable=False),
        sa.Column("bytes", sa.BigInteger, nullable=False),
        sa.Column("created_at", moment, nullable=False),
        sa.Column("finished_at", moment),
        sa.Column("claimed_by", sa.String(32)),
        sa.Column("claimed_until", moment),
        sa.UniqueConstraint("owner", "idempotency_key"),
    )
    op.create_table(
        "keys",
        sa.Column("id", sa.String(16), primary_key=True),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False, unique=True),
        sa.Column("scope", sa.String(16), nullable=False),
        sa.Column("owner", sa.String(16), nullable=False),
        sa.Column("created_at", moment, nullable=False),
        sa.Column("expires_at", moment),
        sa.Column("revoked_at", moment),
    )
