-- title: Takes without a publication, and messages that were not taken, each with its reason
-- description: Every take whose publication is not known, and every message that a subscription of
--     its topic did not take, in order of time. The query topics --measure delivery counts them.
-- grain: one row per take without a publication, or publication and subscription without a take
-- param: side VARCHAR {take|publication} = NULL   Only takes without a publication, or only
--     publications without a take
-- param: reason VARCHAR {before_subscription|subscription_ended|reader_in_callback|receiver_gap|
--     never_taken|before_discovery|no_longer_taken|take_failed|not_delivered|overwritten|
--     lost_in_transport|pending_at_end|no_stamp|clock_set|before_tracing|publisher_gap|
--     publisher_without_events|publisher_trace_ends|publisher_not_traced|ambiguous|
--     unknown} = NULL  Only this reason
-- column: run_id, at_ns
-- column: side VARCHAR            'publication' or 'take': the side that is known
-- column: topic_name
-- column: publisher VARCHAR [node]  Node that published; empty: not known
-- column: subscriber VARCHAR [node]  Node that took, or should have taken
-- column: status VARCHAR          'dropped', 'lost', 'not_connected', 'cut_by_recording',
--     'unknown', as with --measure delivery; 'orphan': a take without a publication
-- column: reason
-- column: source_timestamp_ns BIGINT [epoch ns]  Stamp of the message
-- column: publication_id
-- column: take_id BIGINT          Identity of the take
-- column: subscription_id, is_internal
-- brief: at_ns, topic_name, side, status, reason, subscriber, publisher, publication_id, take_id
WITH missing AS (
    SELECT
        d.run_id,
        b.start_ns AS at_ns,
        'publication' AS side,
        d.publisher_id, d.status, d.reason, b.source_timestamp_ns, d.publication_id,
        NULL::BIGINT AS take_id,
        d.subscription_id, s.process_id
    FROM main.stat_delivery AS d
    JOIN main.publication AS b ON d.publication_id = b.publication_id
    JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
    WHERE d.status <> 'delivered'
    UNION ALL
    SELECT
        o.run_id, t.taken_ns, 'take', NULL, 'orphan', o.reason,
        t.source_timestamp_ns, NULL, o.take_id, o.subscription_id, t.process_id
    FROM main.stat_orphan AS o
    JOIN main.take AS t ON o.take_id = t.take_id
)
SELECT
    m.run_id, m.at_ns, m.side,
    coalesce(s.topic_name, b.topic_name) AS topic_name,
    main.node_label(bn.full_name, bp.name, bp.pid) AS publisher,
    main.node_label(sn.full_name, sp.name, sp.pid) AS subscriber,
    m.status, m.reason, m.source_timestamp_ns, m.publication_id, m.take_id, m.subscription_id,
    coalesce(s.is_internal, b.is_internal, false) AS is_internal
FROM missing AS m
LEFT JOIN main.subscription AS s ON m.subscription_id = s.subscription_id
LEFT JOIN main.node AS sn ON s.node_id = sn.node_id
LEFT JOIN main.process AS sp ON m.process_id = sp.process_id
LEFT JOIN main.publisher AS b ON m.publisher_id = b.publisher_id
LEFT JOIN main.node AS bn ON b.node_id = bn.node_id
LEFT JOIN main.process AS bp ON b.process_id = bp.process_id
WHERE list_contains($runs, m.run_id)
    AND m.at_ns >= $start_ns
    AND m.at_ns < $end_ns
    AND ($side IS NULL OR m.side = $side)
    AND ($reason IS NULL OR m.reason = $reason)
ORDER BY m.run_id, m.at_ns, m.side, m.publication_id, m.take_id, m.subscription_id
