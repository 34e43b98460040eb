-- name: derive.link_diagnostic
-- description: What the links say about the input: takes without a publication, links that are a
--     guess, messages that seem to arrive before they were published, and publications for which
--     inputs of their annotation had no message.
-- grain: one row per finding
-- needs: store.take, store.subscription, store.publication, store.link_transport,
--     derive.process_clock, derive.corrected_ns, derive.annotation_firing,
--     store.diagnostic
WITH unmatched AS (
    SELECT t.run_id, t.trace_id, s.topic_name, t.source_timestamp_ns IS NULL AS has_no_stamp
    FROM store.take AS t
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id
),
by_topic AS (
    SELECT run_id, trace_id, has_no_stamp, coalesce(topic_name, '?') AS topic_name,
        count(*) AS number
    FROM unmatched
    GROUP BY ALL
),
latency AS (
    SELECT
        l.run_id,
        bc.clock_id = tc.clock_id AS has_one_clock,
        derive.corrected_ns(t.taken_ns, tc.offset_ns, tc.drift_ppb, tc.reference_ns)
        - derive.corrected_ns(b.end_ns, bc.offset_ns, bc.drift_ppb, bc.reference_ns)
            AS latency_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN derive.process_clock AS bc ON b.process_id = bc.process_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN derive.process_clock AS tc ON t.process_id = tc.process_id
)
SELECT
    run_id,
    trace_id,
    'unmatched_take' AS name,
    'warning' AS severity,
    sum(number)::BIGINT AS count,
    'messages received whose publication is not known'
    || CASE WHEN has_no_stamp THEN ', and that carry no stamp: ' ELSE ': ' END
    || string_agg(printf('%s (%d)', topic_name, number), ', ' ORDER BY topic_name) AS detail
FROM by_topic
GROUP BY run_id, trace_id, has_no_stamp
UNION ALL
SELECT
    l.run_id,
    NULL,
    'ambiguous_link',
    'warning',
    count(*),
    'messages that several publications could have been: see candidate_count of link_transport'
FROM store.link_transport AS l
WHERE l.candidate_count > 1
GROUP BY l.run_id
UNION ALL
SELECT
    run_id,
    NULL,
    'negative_latency',
    'warning',
    count(*),
    printf(
        'messages that seem to be received up to %.3f ms before they were published: the clocks '
        || 'of the hosts are apart; msgflow clocks apply %s',
        -min(latency_ns) / 1e6,
        CASE
            WHEN run_id IN (
                SELECT run_id FROM store.diagnostic WHERE name = 'clock_not_synchronised'
            ) THEN 'FILE'
            ELSE 'messages'
        END
    )
FROM latency
WHERE latency_ns < 0 AND NOT has_one_clock
GROUP BY run_id
UNION ALL
SELECT
    run_id,
    NULL,
    'early_take',
    'info',
    count(*),
    printf(
        'messages that were received up to %.3f ms before the call of publish() returned, on the '
        || 'same clock: latency counts from the last event of the call, and is negative for them',
        -min(latency_ns) / 1e6
    )
FROM latency
WHERE latency_ns < 0 AND has_one_clock
GROUP BY run_id
UNION ALL
SELECT
    run_id,
    NULL,
    'incomplete_firing',
    'info',
    count(*),
    'publications that an annotation explains, but for which some of its inputs had no message '
    || 'when the callback that publishes began (none yet, none since the caches were emptied, one '
    || 'that came only meanwhile, or a gap lies in between): see annotation_firing'
FROM derive.annotation_firing
WHERE linked_count < input_count
GROUP BY run_id
