"""Runs, visits and raw samples."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Create the first tables."""
    op.create_table(
        "runs",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("rig_name", sa.Text, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("created_utc", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_utc", sa.DateTime(timezone=True), nullable=True),
        sa.Column("finished_utc", sa.DateTime(timezone=True), nullable=True),
        sa.Column("plan", sa.JSON, nullable=False),
        sa.Column("site", sa.JSON, nullable=False),
        sa.Column("rig", sa.JSON, nullable=False),
        sa.Column("simulation", sa.JSON, nullable=True),
        sa.Column("software", sa.JSON, nullable=False),
        sa.Column("result", sa.JSON, nullable=True),
        sa.Column("error", sa.Text, nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_runs"),
    )
    op.create_index("ix_runs_created_utc", "runs", ["created_utc"])
    op.create_table(
        "visits",
        sa.Column("run_id", sa.String(32), nullable=False),
        sa.Column("index", sa.Integer, autoincrement=False, nullable=False),
        sa.Column("segment", sa.Integer, nullable=False),
        sa.Column("direction", sa.String(16), nullable=False),
        sa.Column("angle_rad", sa.Double, nullable=False),
        sa.Column("gyro_mean_rad_s", sa.Double, nullable=False),
        sa.Column("gyro_sigma_rad_s", sa.Double, nullable=False),
        sa.Column("accel_mean_g", sa.Double, nullable=False),
        sa.Column("accel_sigma_g", sa.Double, nullable=False),
        sa.Column("samples", sa.Integer, nullable=False),
        sa.Column("lost", sa.Integer, nullable=False),
        sa.Column("start_s", sa.Double, nullable=False),
        sa.Column("turned_rad", sa.Double, nullable=True),
        sa.PrimaryKeyConstraint("run_id", "index", name="pk_visits"),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_visits_run_id_runs"),
    )
    op.create_table(
        "samples",
        sa.Column("run_id", sa.String(32), nullable=False),
        sa.Column("visit_index", sa.Integer, autoincrement=False, nullable=False),
        sa.Column("stream", sa.String(16), nullable=False),
        sa.Column("arrow", sa.LargeBinary, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("run_id", "visit_index", "stream", name="pk_samples"),
        sa.ForeignKeyConstraint(
            ["run_id", "visit_index"],
            ["visits.run_id", "visits.index"],
            name="fk_samples_run_id_visits",
        ),
    )
