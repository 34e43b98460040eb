-- description: Messages that were taken on the topics of publications without a stamp, unless a
--     publication with their stamp is known. All takes of one message have its topic and stamp.
--     Where the middleware has no event of writing, it may have written a message for each
--     subscription on its own, with another stamp each time: there, each is looked for alone.
-- grain: one row per message, subscription if that counts (else 0), and clock of a process that
--     took it
CREATE OR REPLACE MACRO derive.unstamped_message(only_run) AS TABLE
WITH topic AS (
    SELECT
        topic_name,
        bool_or(is_without_event) AS is_divided
    FROM derive.unstamped_publication(only_run)
    GROUP BY topic_name
),
stamped AS (
    SELECT p.topic_name, b.source_timestamp_ns
    FROM store.publication AS b
    LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    LEFT JOIN topic AS w ON p.topic_name = w.topic_name
    WHERE b.run_id = only_run AND (w.topic_name IS NOT NULL OR p.topic_name IS NULL)
),
received AS (
    SELECT
        t.run_id, s.topic_name, t.source_timestamp_ns, t.process_id, t.taken_ns,
        CASE WHEN w.is_divided THEN t.subscription_id ELSE 0 END AS only_subscription_id
    FROM store.take AS t
    JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN topic AS w ON s.topic_name = w.topic_name
    WHERE t.run_id = only_run AND t.source_timestamp_ns <> 0
)
SELECT
    r.run_id, r.topic_name, r.source_timestamp_ns, r.only_subscription_id, h.clock_id,
    min(r.taken_ns) AS taken_ns
FROM received AS r
ANTI JOIN stamped AS x
    ON r.source_timestamp_ns = x.source_timestamp_ns AND r.topic_name = x.topic_name
ANTI JOIN stamped AS y ON r.source_timestamp_ns = y.source_timestamp_ns AND y.topic_name IS NULL
JOIN store.process AS o ON r.process_id = o.process_id
JOIN store.host AS h ON o.host_id = h.host_id
GROUP BY r.run_id, r.topic_name, r.source_timestamp_ns, r.only_subscription_id, h.clock_id
