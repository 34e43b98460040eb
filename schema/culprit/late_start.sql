-- title: A node that began long after the others
-- description: What came before is lost. What lost nothing is no culprit.
-- grain: one row per node
-- reads: application_path, noticed, whole_delivery
-- next: query topics --measure delivery --topic {topic_name}
SELECT
    8 AS place,
    c.full_name AS node,
    arg_max(p.path, p.age_ns) AS path,
    any_value(d.topic_name) AS topic_name,
    any_value(c.late_ns / 2 * c.late_ns / p.length_ns)::BIGINT AS harm_ns,
    any_value(c.late_ns) AS p95_ns,
    any_value(d.missed) AS lost,
    any_value(d.published) AS published,
    any_value(c.late_ns) AS run_ns,
    [c.full_name] AS claims
FROM (
    SELECT
        full_name, created_ns,
        (created_ns - quantile_disc(created_ns, 0.5) OVER ())::BIGINT AS late_ns
    -- A node that is made again was there before.
    FROM (
        SELECT
            full_name,
            min(created_ns) AS created_ns
        FROM main.node
        WHERE list_contains($runs, run_id) AND NOT is_inferred
        GROUP BY full_name
    )
) AS c
-- A display or a log that begins late loses nothing that others need.
JOIN application_path AS p ON list_contains(p.steps[:-2], c.full_name)
JOIN (
    SELECT
        subscriber,
        arg_max(topic_name, reasons['before_subscription']) AS topic_name,
        max(reasons['before_subscription'])::BIGINT AS missed,
        arg_max(published, reasons['before_subscription']) AS published
    FROM (
        FROM whole_delivery
        QUALIFY subscription_id = min(subscription_id) OVER (PARTITION BY subscriber, topic_name)
    )
    WHERE reasons['before_subscription'] > 0
    GROUP BY subscriber
) AS d
    ON c.full_name = d.subscriber
CROSS JOIN noticed AS l
WHERE c.late_ns > greatest(l.start_ns, l.of_recording * p.length_ns)
    AND c.created_ns >= $asked_ns AND c.created_ns < $end_ns
    AND d.missed >= l.lost AND d.missed >= l.of_messages * d.published
GROUP BY c.full_name
