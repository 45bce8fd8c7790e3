"""The tables of version 0.14, which ``veselova.service.access.database`` makes."""

revision = "0014"
down_revision = None
