"""States of threads, from kernel traces.

Older runs have none: they have to be read again, with their kernel traces.
"""

from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables."""
    op.execute("""
        CREATE TABLE store.other_thread (
            other_thread_id BIGINT NOT NULL, run_id BIGINT NOT NULL, host_id BIGINT NOT NULL,
            tid INTEGER NOT NULL, name VARCHAR, PRIMARY KEY (other_thread_id)
        )
    """)
    op.execute("""
        CREATE TABLE store.thread_state (
            run_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, start_ns BIGINT NOT NULL,
            end_ns BIGINT NOT NULL, state VARCHAR NOT NULL, cpu INTEGER, priority INTEGER,
            preempted_by_thread_id BIGINT, preempted_by_other_thread_id BIGINT,
            preempted_by_priority INTEGER, waker_kind VARCHAR, waker_thread_id BIGINT,
            waker_other_thread_id BIGINT, is_loss_affected BOOLEAN DEFAULT false NOT NULL
        )
    """)
    op.execute("""
        CREATE TABLE store.callback_schedule (
            run_id BIGINT NOT NULL, callback_instance_id BIGINT NOT NULL,
            running_ns BIGINT NOT NULL, preempted_ns BIGINT NOT NULL, runnable_ns BIGINT NOT NULL,
            sleeping_ns BIGINT NOT NULL, uninterruptible_ns BIGINT NOT NULL,
            unknown_ns BIGINT NOT NULL, preemption_count BIGINT NOT NULL,
            migration_count BIGINT NOT NULL, is_loss_affected BOOLEAN DEFAULT false NOT NULL
        )
    """)
