"""Events with a sequence number, leases, and what a list of runs shows."""

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"

# The tables as they are at this revision, whatever later ones make of them.
_TIME = sa.DateTime(timezone=True)
_RUNS = sa.table(
    "runs",
    sa.column("id", sa.String),
    sa.column("state", sa.String),
    sa.column("created_utc", _TIME),
    sa.column("started_utc", _TIME),
    sa.column("finished_utc", _TIME),
    sa.column("result", sa.JSON(none_as_null=True)),
    sa.column("progress", sa.Double),
    sa.column("headline", sa.JSON(none_as_null=True)),
    sa.column("last_seq", sa.Integer),
)
_EVENTS = sa.table(
    "events",
    sa.column("run_id", sa.String),
    sa.column("seq", sa.Integer),
    sa.column("time_utc", _TIME),
    sa.column("event", sa.String),
    sa.column("data", sa.JSON),
)


def upgrade() -> None:
    """Add them; of the runs so far, take what their results say."""
    op.create_table(
        "events",
        sa.Column("run_id", sa.String(32), nullable=False),
        sa.Column("seq", sa.Integer, autoincrement=False, nullable=False),
        sa.Column("time_utc", _TIME, nullable=False),
        sa.Column("event", sa.String(16), nullable=False),
        sa.Column("data", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("run_id", "seq", name="pk_events"),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_events_run_id_runs"),
    )
    for column in (
        sa.Column("prediction", sa.JSON, nullable=True),
        sa.Column("progress", sa.Double, nullable=False, server_default="0"),
        sa.Column("headline", sa.JSON, nullable=True),
        sa.Column("last_seq", sa.Integer, nullable=False, server_default="0"),
        sa.Column("lease_holder", sa.Text, nullable=True),
        sa.Column("lease_expires_utc", _TIME, nullable=True),
        sa.Column("idempotency_key", sa.Text, nullable=True),
        sa.Column("request_sha256", sa.String(64), nullable=True),
    ):
        op.add_column("runs", column)
    op.add_column("visits", sa.Column("repeats", sa.Integer, nullable=True))
    op.drop_index("ix_runs_created_utc", "runs")
    listed = ["created_utc", "id", "kind", "state", "rig_name"]
    op.create_index("ix_runs_newest", "runs", listed)
    op.create_index("ix_runs_lease_holder", "runs", ["lease_holder"])
    op.create_index("ix_runs_idempotency_key", "runs", ["idempotency_key"], unique=True)
    _fill(op.get_bind())


def _fill(connection: sa.Connection) -> None:
    """Give each run its headline, and the one event that tells a listener where it stands."""
    ids = connection.scalars(sa.select(_RUNS.c.id)).all()
    for run_id in ids:
        row = connection.execute(sa.select(_RUNS).where(_RUNS.c.id == run_id)).one()
        state_event = {
            "run_id": run_id,
            "seq": 1,
            "time_utc": row.finished_utc or row.started_utc or row.created_utc,
            "event": "state",
            "data": {"state": row.state},
        }
        connection.execute(sa.insert(_EVENTS).values(state_event))
        shown: dict[str, Any] = {"last_seq": 1}
        if row.result is not None:
            shown |= {"progress": 1.0, "headline": _headline(row.result)}
        connection.execute(sa.update(_RUNS).where(_RUNS.c.id == run_id).values(shown))


def _headline(result: dict[str, Any]) -> dict[str, Any] | None:
    if "azimuth_deg" not in result:
        return None
    checks = result.get("checks", [])
    statuses = [check["status"] for check in checks]
    return {
        "azimuth_deg": result["azimuth_deg"],
        "azimuth_sigma_deg": result["azimuth_sigma_deg"],
        "checks": {status: statuses.count(status) for status in ("pass", "warn", "fail")},
        "attention": [check["name"] for check in checks if check["status"] != "pass"],
    }
