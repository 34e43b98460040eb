-- title: Messages delivered, dropped and lost by topic and receiver, of many runs
-- description: As the query topics --measure delivery says it of one run. Counts are added, and the
--     shares are of their sums.
-- grain: one row per topic, receiving node and group of runs
-- column: label_group, topic_name, subscriber, runs
-- column: lossy_runs BIGINT         Of these, runs in which messages were dropped or lost
-- column: published BIGINT          Messages published on the topic
-- column: delivered, dropped, lost
-- column: not_connected BIGINT      Of these, before or after the two were connected
-- column: cut_by_recording, unknown, delivered_percent, lost_percent
-- column: orphans BIGINT            Takes whose publication is not known
-- column: reasons, orphan_reasons, is_internal
-- brief: topic_name, subscriber, delivered (even 0), dropped (even 0), lost (even 0),
--     delivered_percent, runs, lossy_runs, unknown (even 0), lost_percent, published, reasons,
--     not_connected, cut_by_recording, orphans, orphan_reasons
WITH merged AS (
    SELECT
        d.label_group, d.topic_name, d.subscriber,
        count(DISTINCT d.run) AS runs,
        count(DISTINCT d.run) FILTER (WHERE d.dropped + d.lost > 0) AS lossy_runs,
        sum(COLUMNS([
            'published', 'delivered', 'dropped', 'lost', 'not_connected', 'cut_by_recording',
            'unknown', 'orphans'
        ]))::BIGINT,
        bool_and(d.is_internal) AS is_internal
    FROM topics_delivery AS d
    GROUP BY d.label_group, d.topic_name, d.subscriber
)
SELECT
    m.label_group, m.topic_name, m.subscriber, m.runs, m.lossy_runs, m.published, m.delivered,
    m.dropped, m.lost, m.not_connected, m.cut_by_recording, m.unknown,
    100.0::DOUBLE * m.delivered / nullif(m.delivered + m.dropped + m.lost, 0) AS delivered_percent,
    100.0::DOUBLE * m.lost / nullif(m.delivered + m.dropped + m.lost, 0) AS lost_percent,
    m.orphans,
    r.numbers AS reasons,
    o.numbers AS orphan_reasons,
    m.is_internal
FROM merged AS m
LEFT JOIN reason_count AS r
    ON r.name = 'reasons' AND m.label_group = r.label_group
    AND m.topic_name IS NOT DISTINCT FROM r.topic_name
    AND m.subscriber IS NOT DISTINCT FROM r.subscriber
LEFT JOIN reason_count AS o
    ON o.name = 'orphan_reasons' AND m.label_group = o.label_group
    AND m.topic_name IS NOT DISTINCT FROM o.topic_name
    AND m.subscriber IS NOT DISTINCT FROM o.subscriber
ORDER BY m.topic_name, m.subscriber, m.label_group
