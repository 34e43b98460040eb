"""What partial traces, services and several clocks need.

Publications know the callback event before them, and when their thread went on; marks of what gaps
may hide, failed takes, and what is missing; messages told by time, ring buffers, takes by hand;
where the records of threads break; callback groups; which request a response answers; which clocks
belong together, and how well drift is known.

Frozen: it does not follow later changes of msgflow/db/tables.py.
"""

import sqlalchemy as sa
from alembic import op
from duckdb_engine.datatypes import UBigInteger

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

_LOSS_AFFECTED = {
    "publication": "A gap right before or after it on its thread may hide a layer",
    "take": "A gap right before or after it on its thread may hide a layer or its callback",
    "callback_instance": "A gap inside or beside it on its thread may hide its end or what it did",
}

# The last begin or end of a callback before each publication, from the stored runs of callbacks.
_CALLBACK_EVENT = """
UPDATE store.publication SET callback_event_id = placed.event_id
FROM (
    SELECT b.publication_id, c.event_id
    FROM store.publication AS b
    ASOF JOIN (
        SELECT run_id, thread_id, start_event_id AS event_id FROM store.callback_instance
        UNION ALL
        SELECT run_id, thread_id, end_event_id FROM store.callback_instance
        WHERE end_event_id IS NOT NULL
    ) AS c
        ON b.run_id = c.run_id AND b.thread_id = c.thread_id AND b.start_event_id > c.event_id
) AS placed
WHERE publication.publication_id = placed.publication_id
"""


_CLOCK_COLUMNS = {
    "drift_uncertainty_ppb": (
        "What its bound grows by per time elapsed since reference_ns or before it; NULL: none, or "
        "not known [1e-9]"
    ),
    "reference_clock_id": (
        "Clock whose times its times become; NULL: not brought together with others"
    ),
}


def upgrade() -> None:
    """Add the columns and tables, and fill the columns for the runs that are there."""
    op.add_column(
        "publication",
        sa.Column(
            "callback_event_id",
            sa.BigInteger(),
            comment="Last begin or end of a callback before it; NULL: none [event order]",
        ),
        schema="store",
    )
    op.execute(_CALLBACK_EVENT)
    for table, comment in _LOSS_AFFECTED.items():
        _add_column(table, "is_loss_affected", sa.Boolean(), f"{comment}; NULL: not known")
    op.create_table(
        "failed_take",
        _required("run_id", "Run that the row belongs to"),
        _required("trace_id", "Trace it was recorded in"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription"),
        _required("process_id", "Process it lives in"),
        _required("thread_id", "Thread it happened on"),
        _required("failed_ns", "Moment of the attempt [epoch ns]"),
        schema="store",
        comment="One row per attempt to take from a subscription that took nothing",
    )
    op.create_table(
        "undelivered",
        _required("run_id", "Run that the row belongs to"),
        _required("publication_id", "The message"),
        _required("publisher_id", "Its publisher"),
        _required("subscription_id", "Who did not take it"),
        sa.Column("reason", sa.String(), nullable=False, comment="Why; a closed vocabulary"),
        schema="store",
        comment=(
            "One row per publication and subscription of its topic that is not known to have "
            "taken it"
        ),
    )
    op.create_table(
        "orphan_take",
        _required("run_id", "Run that the row belongs to"),
        _required("take_id", "The take"),
        sa.Column("subscription_id", sa.BigInteger(), comment="Subscription that received it"),
        sa.Column("reason", sa.String(), nullable=False, comment="Why; a closed vocabulary"),
        schema="store",
        comment="One row per take whose publication is not known",
    )
    _create_thread_break()
    _create_callback_groups()
    _create_links()
    _add_services_and_clocks()


def _create_thread_break() -> None:
    op.create_table(
        "thread_break",
        _required("run_id", "Run that the row belongs to"),
        _required("thread_id", "Thread whose events may be missing"),
        _required("resumed_ns", "First event of the thread behind the gap [epoch ns]"),
        sa.Column(
            "resumed_event_id",
            sa.BigInteger(),
            comment="First event of the thread behind the gap [event order]",
        ),
        schema="store",
        comment="One row per gap in the record of a thread",
    )


def _create_callback_groups() -> None:
    op.create_table(
        "callback_group",
        sa.Column(
            "callback_group_id",
            sa.BigInteger(),
            primary_key=True,
            autoincrement=False,
            comment="Identity of the callback group",
        ),
        _required("run_id", "Run that the row belongs to"),
        _required("process_id", "Process it lives in"),
        sa.Column("executor_id", sa.BigInteger(), comment="Executor that it was added to"),
        sa.Column(
            "kind",
            sa.String(),
            nullable=False,
            comment="'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it",
        ),
        schema="store",
        comment="One row per callback group of an executor, where the trace tells (CARET)",
    )
    op.create_table(
        "callback_group_member",
        _required("run_id", "Run that the row belongs to"),
        _required("callback_group_id", "The callback group"),
        _required("callback_id", "The callback"),
        schema="store",
        comment="One row per callback in a callback group",
    )


def _create_links() -> None:
    op.execute("ALTER TABLE store.publication ADD COLUMN next_event_ns BIGINT")
    _comment(
        "COLUMN store.publication.next_event_ns",
        "Next event of the thread, where it has no stamp; NULL: none, or a gap may hide it "
        "[epoch ns]",
    )
    op.execute("ALTER TABLE store.link_causal ALTER COLUMN callback_instance_id DROP NOT NULL")
    _comment(
        "TABLE store.link_causal",
        "One row per callback run, or take outside of any, that led to a publication",
    )
    _comment("COLUMN store.link_causal.callback_instance_id", "Cause; NULL: the take itself")
    _comment("COLUMN store.link_causal.take_id", "Message that led to it")
    op.create_table(
        "ring_buffer_event",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("trace_id", sa.BigInteger(), nullable=False, comment="Trace it was recorded in"),
        sa.Column("process_id", sa.BigInteger(), nullable=False, comment="Process it lives in"),
        sa.Column("kind", sa.String(), nullable=False, comment="'enqueue', 'dequeue' or 'clear'"),
        sa.Column(
            "buffer_handle",
            UBigInteger(),
            comment="Address of the ring buffer; an address, valid in its process until reused",
        ),
        sa.Column("slot", sa.BigInteger(), comment="Index in the buffer; NULL: all"),
        sa.Column(
            "at_ns", sa.BigInteger(), nullable=False, comment="Moment of the event [epoch ns]"
        ),
        sa.Column(
            "publication_id",
            sa.BigInteger(),
            comment="Message put in; NULL: the replay of one kept for late subscriptions",
        ),
        sa.Column("take_id", sa.BigInteger(), comment="Message taken out"),
        sa.Column(
            "is_overwriting",
            sa.Boolean(),
            nullable=False,
            comment="An older message was lost from the slot",
        ),
        sa.Column("event_id", sa.BigInteger(), comment="The event [event order]"),
        schema="store",
        comment="One row per enqueue, dequeue or clearing of an intra-process ring buffer",
    )
    op.create_table(
        "stamp_clock",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("clock_id", sa.BigInteger(), nullable=False, comment="Clock of the traces"),
        sa.Column(
            "at_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Middle of the stretch, time of the traces [epoch ns]",
        ),
        sa.Column(
            "start_ns", sa.BigInteger(), nullable=False, comment="Begin of the stretch [epoch ns]"
        ),
        sa.Column(
            "end_ns",
            sa.BigInteger(),
            nullable=False,
            comment="End of the stretch, exclusive [epoch ns]",
        ),
        sa.Column(
            "difference_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Clock of ROS less clock of the traces, with the shortest delay of a stamp "
            "[ns]",
        ),
        sa.Column(
            "drift_ppb", sa.BigInteger(), comment="Change of the difference in the stretch [ppb]"
        ),
        sa.Column("message_count", sa.BigInteger(), comment="Messages that agree with it"),
        schema="store",
        comment="One row per stretch of time in which stamps run along a clock of the traces",
    )
    op.create_table(
        "nearest_message",
        sa.Column("run_id", sa.BigInteger(), nullable=False, comment="Run that the row belongs to"),
        sa.Column("topic_name", sa.String(), nullable=False, comment="Topic of the message"),
        sa.Column(
            "source_timestamp_ns",
            sa.BigInteger(),
            nullable=False,
            comment="Stamp of the message, clock of ROS [epoch ns]",
        ),
        sa.Column(
            "publication_id",
            sa.BigInteger(),
            comment="Where it came from; NULL: several could be it",
        ),
        sa.Column(
            "candidate_count", sa.BigInteger(), comment="Publications that it could have been"
        ),
        schema="store",
        comment="One row per message whose publication was found, or could not be told, by time",
    )


def _add_services_and_clocks() -> None:
    op.execute("ALTER TABLE store.response ADD COLUMN request_id BIGINT")
    _comment("COLUMN store.response.request_id", "Request that it answers")
    for name, comment in _CLOCK_COLUMNS.items():
        op.execute(f"ALTER TABLE store.clock ADD COLUMN {name} BIGINT")
        _comment(f"COLUMN store.clock.{name}", comment)


def downgrade() -> None:
    """Drop the columns and tables."""
    for name in _CLOCK_COLUMNS:
        op.drop_column("clock", name, schema="store")
    op.drop_column("response", "request_id", schema="store")
    for table in ("nearest_message", "stamp_clock", "ring_buffer_event"):
        op.drop_table(table, schema="store")
    op.execute("DELETE FROM store.link_causal WHERE callback_instance_id IS NULL")
    op.execute("ALTER TABLE store.link_causal ALTER COLUMN callback_instance_id SET NOT NULL")
    op.execute("ALTER TABLE store.publication DROP COLUMN next_event_ns")
    for table in ("callback_group_member", "callback_group", "thread_break"):
        op.drop_table(table, schema="store")
    for table in ("orphan_take", "undelivered", "failed_take"):
        op.drop_table(table, schema="store")
    for table in _LOSS_AFFECTED:
        op.drop_column(table, "is_loss_affected", schema="store")
    op.drop_column("publication", "callback_event_id", schema="store")


def _required(name: str, comment: str) -> sa.Column[int]:
    return sa.Column(name, sa.BigInteger(), nullable=False, comment=comment)


def _add_column(table: str, name: str, kind: sa.types.TypeEngine[object], comment: str) -> None:
    op.add_column(table, sa.Column(name, kind), schema="store")
    op.execute(f"COMMENT ON COLUMN store.{table}.{name} IS '{comment}'")


def _comment(of: str, text: str) -> None:
    op.execute(f"COMMENT ON {of} IS '{text.replace(chr(39), chr(39) * 2)}'")
