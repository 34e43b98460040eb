-- title: Messages received whose publication is not known
-- description: Messages were received whose publication is not known. Their flows begin at the
--     take.
-- cause: The publisher is not traced, events of it were lost, or the message carries no stamp. Of
--     messages that are matched by time (Humble, Iron), several publications may be meant.
-- cure: msgflow query topics --measure unmatched gives the reason of each. The findings
--     publisher_not_traced, publisher_without_events, trace_ends_early and message_without_stamp
--     say what can be done.
-- next: query topics --measure unmatched
-- grain: one row per trace, for messages with a stamp and without
-- severity: warning
-- when: store.orphan_take
SELECT
    run_id, trace_id,
    sum(number) AS count,
    'messages received whose publication is not known'
    || CASE WHEN has_no_stamp THEN ', and that carry no stamp: ' ELSE ': ' END
    || string_agg(printf('%s (%d)', topic_name, number), ', ' ORDER BY topic_name) AS detail
FROM (
    SELECT
        o.run_id, t.trace_id,
        coalesce(s.topic_name, '?') AS topic_name,
        t.source_timestamp_ns IS NULL AS has_no_stamp,
        count(*) AS number
    FROM store.orphan_take AS o
    JOIN store.take AS t ON o.take_id = t.take_id
    LEFT JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
    GROUP BY ALL
)
GROUP BY run_id, trace_id, has_no_stamp
