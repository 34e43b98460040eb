"""What threads do with requests and responses without a callback, and how flows go on from there.

Both tables are derived from others: an upgrade fills them.
"""

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the one table, and make the other anew."""
    op.execute("""
        CREATE TABLE store.link_call (
            run_id BIGINT NOT NULL, taken_request_id BIGINT, taken_response_id BIGINT,
            publication_id BIGINT, publisher_id BIGINT, request_id BIGINT, response_id BIGINT,
            candidate_count BIGINT NOT NULL
        )
    """)
    op.execute("DROP TABLE store.flow_call")
    op.execute("""
        CREATE TABLE store.flow_call (
            run_id BIGINT NOT NULL, publication_id BIGINT NOT NULL, publisher_id BIGINT,
            kind VARCHAR NOT NULL, callback_instance_id BIGINT, taken_request_id BIGINT,
            taken_response_id BIGINT, caller_id BIGINT NOT NULL, route BIGINT[] NOT NULL,
            take_id BIGINT, subscription_id BIGINT
        )
    """)
