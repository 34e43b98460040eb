-- description: Takes whose publication is not known, and why.
-- grain: one row per take without a publication
-- column: run_id
-- column: take_id BIGINT  Identity of the take
-- column: subscription_id BIGINT  Subscription that took it
-- column: reason VARCHAR  'no_stamp', 'receiver_gap' (the event with the stamp was lost),
--     'clock_set' (the clock that stamps messages was set about then), 'before_tracing',
--     'publisher_gap', 'publisher_without_events', 'publisher_trace_ends', 'publisher_not_traced',
--     'ambiguous' or 'unknown', the first that holds
SELECT run_id, take_id, subscription_id, reason FROM store.orphan_take
