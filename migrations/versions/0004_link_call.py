"""What threads do with requests and responses without a callback, and how flows go on from there.

All of it is derived from other tables: an upgrade does so anew.
"""

from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add a table and columns."""
    op.execute("""
        CREATE TABLE store.link_call (
            run_id BIGINT NOT NULL, taken_request_id BIGINT, taken_response_id BIGINT,
            publication_id BIGINT, publisher_id BIGINT, request_id BIGINT, response_id BIGINT,
            candidate_count BIGINT NOT NULL
        )
    """)
    op.execute("ALTER TABLE store.flow_call ALTER COLUMN callback_instance_id DROP NOT NULL")
    op.execute("ALTER TABLE store.flow_call ADD COLUMN taken_request_id BIGINT")
    op.execute("ALTER TABLE store.flow_call ADD COLUMN taken_response_id BIGINT")
