"""What had the CPU while threads waited for it, interrupts during callbacks, CPU usage.

Older runs have none: they have to be read again, with their kernel traces.
"""

from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns and tables."""
    op.execute("ALTER TABLE store.callback_schedule ADD COLUMN irq_ns BIGINT")
    op.execute("ALTER TABLE store.callback_schedule ADD COLUMN softirq_ns BIGINT")
    op.execute("""
        CREATE TABLE store.preemptor (
            run_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, start_ns BIGINT NOT NULL,
            end_ns BIGINT NOT NULL, state VARCHAR NOT NULL, cpu INTEGER,
            preemptor_thread_id BIGINT, preemptor_other_thread_id BIGINT,
            preemptor_priority INTEGER, thread_priority INTEGER
        )
    """)
    op.execute("""
        CREATE TABLE store.callback_preemptor (
            run_id BIGINT NOT NULL, callback_instance_id BIGINT NOT NULL,
            preemptor_thread_id BIGINT, preemptor_other_thread_id BIGINT,
            preemptor_priority INTEGER, preempted_ns BIGINT NOT NULL, runnable_ns BIGINT NOT NULL
        )
    """)
    op.execute("""
        CREATE TABLE store.cpu_usage (
            run_id BIGINT NOT NULL, host_id BIGINT NOT NULL, cpu INTEGER, start_ns BIGINT NOT NULL,
            thread_id BIGINT, tid INTEGER NOT NULL, name VARCHAR, running_ns BIGINT NOT NULL
        )
    """)
