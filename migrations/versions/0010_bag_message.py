"""Messages of a bag that was recorded in the same run.

Older runs have none: msgflow bag joins one.
"""

from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.execute("""
        CREATE TABLE store.bag_message (
            run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, topic_name VARCHAR NOT NULL,
            type_name VARCHAR NOT NULL, received_ns BIGINT NOT NULL, size_bytes BIGINT NOT NULL,
            stamp_ns BIGINT, frame_id VARCHAR
        )
    """)
