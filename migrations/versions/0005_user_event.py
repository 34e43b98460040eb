"""Events of the user's own programs.

Older runs have none: they have to be read again with --events.
"""

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.execute("""
        CREATE TABLE store.user_event (
            user_event_id BIGINT NOT NULL, run_id BIGINT NOT NULL, trace_id BIGINT NOT NULL,
            process_id BIGINT NOT NULL, thread_id BIGINT NOT NULL, cpu INTEGER,
            at_ns BIGINT NOT NULL, name VARCHAR NOT NULL, callback_instance_id BIGINT,
            fields VARCHAR NOT NULL, is_loss_affected BOOLEAN DEFAULT false NOT NULL
        )
    """)
