-- title: Messages delivered, dropped and lost by topic and subscription
-- description: What became of the messages published in the time window at each subscription of
--     their topic. Dropped: the queue was full. Lost: they did not arrive or could not be taken,
--     though earlier and later ones were. Not connected: not yet, not any more, or never. Cut by
--     the recording: it ended before they could be taken. Unknown: events are lost, or the trace
--     does not decide. With delivered, these counts add up to what was published. The shares are of
--     messages whose fate is known: delivered, dropped or lost. Only the depth of the queue tells
--     overwriting from loss on the way; incompatible QoS, lifespan and best effort do not show in a
--     trace.
-- grain: one row per topic and subscription
-- column: run_id, topic_name
-- column: subscriber VARCHAR [node]  Node that subscribes
-- column: published BIGINT          Messages published on the topic in the time window
-- column: delivered BIGINT          Of these, taken
-- column: dropped BIGINT            Of these, those that newer ones replaced in a full queue
-- column: lost BIGINT               Of these, lost on the way
-- column: not_connected BIGINT      Of these, while the two were not connected
-- column: cut_by_recording BIGINT   Of these, those that the end of the recording left untaken
-- column: unknown BIGINT            Of these, with an unknown fate
-- column: delivered_percent DOUBLE [%]  Share delivered, of those delivered, dropped or lost
-- column: lost_percent DOUBLE [%]   Share lost, of the same
-- column: orphans BIGINT            Takes in the time window whose publication is not known
-- column: reasons MAP(VARCHAR, BIGINT)  Why messages were not taken, and how many
-- column: orphan_reasons MAP(VARCHAR, BIGINT)  Why publications are not known, and how many
-- column: subscription_id, is_internal
-- brief: topic_name, subscriber, delivered (even 0), dropped (even 0), lost (even 0), reasons,
--     not_connected, unknown (even 0), delivered_percent, lost_percent, published,
--     cut_by_recording, orphans, orphan_reasons
-- next: query topics --measure unmatched --topic {topic_name} | query topics --measure unmatched
WITH delivery AS (
    SELECT
        d.subscription_id,
        count(*) AS published,
        count(*) FILTER (WHERE d.status = 'delivered') AS delivered,
        count(*) FILTER (WHERE d.status = 'dropped') AS dropped,
        count(*) FILTER (WHERE d.status = 'lost') AS lost,
        count(*) FILTER (WHERE d.status = 'not_connected') AS not_connected,
        count(*) FILTER (WHERE d.status = 'cut_by_recording') AS cut_by_recording,
        count(*) FILTER (WHERE d.status = 'unknown') AS unknown,
        main.word_counts(d.reason) AS reasons
    FROM main.stat_delivery AS d
    JOIN main.publication AS b ON d.publication_id = b.publication_id
    WHERE list_contains($runs, d.run_id) AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
    GROUP BY d.subscription_id
),
orphan AS (
    SELECT
        o.subscription_id,
        count(*) AS orphans,
        main.word_counts(o.reason) AS orphan_reasons
    FROM main.stat_orphan AS o
    JOIN main.take AS t ON o.take_id = t.take_id
    WHERE list_contains($runs, o.run_id) AND t.taken_ns >= $start_ns AND t.taken_ns < $end_ns
    GROUP BY o.subscription_id
)
SELECT
    s.run_id, s.topic_name,
    main.node_label(n.full_name, p.name, p.pid) AS subscriber,
    coalesce(COLUMNS([
        'published', 'delivered', 'dropped', 'lost', 'not_connected', 'cut_by_recording', 'unknown'
    ]), 0),
    100 * delivered / nullif(delivered + dropped + lost, 0) AS delivered_percent,
    100 * lost / nullif(delivered + dropped + lost, 0) AS lost_percent,
    coalesce(o.orphans, 0) AS orphans,
    d.reasons, o.orphan_reasons, s.subscription_id, s.is_internal
FROM main.subscription AS s
JOIN main.process AS p ON s.process_id = p.process_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
LEFT JOIN delivery AS d ON s.subscription_id = d.subscription_id
LEFT JOIN orphan AS o ON s.subscription_id = o.subscription_id
WHERE list_contains($runs, s.run_id)
    AND (d.subscription_id IS NOT NULL OR o.subscription_id IS NOT NULL)
ORDER BY s.run_id, s.topic_name NULLS LAST, subscriber, s.subscription_id
