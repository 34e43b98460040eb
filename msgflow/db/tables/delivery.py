"""Tables of missing messages: publications not taken, and takes without a publication."""

from __future__ import annotations

from sqlalchemy import Table

from msgflow.db.tables.column import STORE, reference, run_id, text

Table(
    "undelivered",
    STORE,
    run_id(),
    reference("publication_id", "The message", to="publication.publication_id", required=True),
    reference("publisher_id", "Its publisher", to="publisher.publisher_id", required=True),
    reference(
        "subscription_id",
        "Subscription that did not take it",
        to="subscription.subscription_id",
        required=True,
    ),
    text("reason", "Why; a closed vocabulary", required=True),
    comment=(
        "One row per publication and subscription of its topic that is not known to have taken it"
    ),
)

Table(
    "orphan_take",
    STORE,
    run_id(),
    reference("take_id", "The take", to="take.take_id", required=True),
    reference(
        "subscription_id", "Subscription that received it", to="subscription.subscription_id"
    ),
    text("reason", "Why; a closed vocabulary", required=True),
    comment="One row per take whose publication is not known",
)
