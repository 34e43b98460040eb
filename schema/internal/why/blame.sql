-- title: What the age of data consists of
-- description: The time that the data at the end of a path take, by the callback that is to blame
--     for it: it runs itself, or others wait behind it. What a queue overwrites makes data older,
--     too, or fewer: that is shared out as the waits of the callback are. Of a queue of 1 only the
--     age counts, since the next message replaces one that is lost.
-- grain: one row per path, callback to blame, and callback that waits for it
-- reads: application_path, breakdown, callback_name, callback_use, callback_wait, delivery,
--     held_message, named_path
-- column: path VARCHAR [path]  The path
-- column: node VARCHAR  Node to blame; NULL: not known
-- column: callback VARCHAR  What triggers its callback; NULL: not known, or not traced
-- column: waiting_node VARCHAR  Node that waits; NULL: the callback itself is on the path
-- column: waiting_callback VARCHAR  What triggers the callback that waits
-- column: is_cpu BOOLEAN  Its thread was ready, and had no CPU
-- column: topic_name VARCHAR  Topic or service whose messages or requests wait, or that the
--     callback publishes
-- column: mean_ns BIGINT [ns]  Mean over all flows of the path; of losses, over all roots
-- column: p95_ns BIGINT [ns]  Of 100 pieces 95 take no longer
-- column: lost BIGINT  Messages lost while it was waited for
-- column: published BIGINT  Messages lost, dropped or delivered there
WITH hop AS (
    SELECT
        p.path_id,
        unnest(range(1, len(p.topics) + 1)) AS hop,
        unnest(p.topics) AS topic_name,
        unnest(p.publishers) AS publisher_id,
        unnest(p.subscriptions) AS subscription_id
    FROM named_path AS p
    WHERE p.is_path AND p.path IN (SELECT path FROM application_path)
),
clock AS (
    SELECT p.process_id, h.clock_id, c.reference_clock_id
    FROM main.process AS p
    JOIN main.host AS h ON p.host_id = h.host_id
    JOIN main.clock AS c ON h.clock_id = c.clock_id
),
-- What a subscription gets from its process and from others runs as two callback objects.
reader AS (
    SELECT DISTINCT
        h.path_id, h.hop, h.topic_name, h.subscription_id,
        coalesce(n.node, main.node_label(d.full_name, r.name, r.pid)) AS node,
        n.callback,
        -- Between clocks that are apart a wait is not known.
        coalesce(
            o.clock_id = i.clock_id OR o.reference_clock_id = i.reference_clock_id, false
        ) AS is_comparable,
        s.subscription_id IN (
            SELECT t.subscription_id
            FROM main.link_causal AS l
            JOIN main.take AS t ON l.take_id = t.take_id
            WHERE list_contains($runs, l.run_id) AND l.kind = 'polled'
        ) AS is_polled
    FROM hop AS h
    JOIN main.subscription AS s ON h.subscription_id = s.subscription_id
    JOIN main.process AS r ON s.process_id = r.process_id
    LEFT JOIN main.node AS d ON s.node_id = d.node_id
    LEFT JOIN main.publisher AS p ON h.publisher_id = p.publisher_id
    LEFT JOIN clock AS o ON p.process_id = o.process_id
    LEFT JOIN clock AS i ON s.process_id = i.process_id
    LEFT JOIN main.callback AS c ON h.subscription_id = c.subscription_id
    LEFT JOIN callback_name AS n ON c.callback_id = n.callback_id
),
piece AS (
    SELECT
        b.path, b.path_id, b.hop, b.part, b.node, b.what, b.p95_ns,
        b.total_ns / a.reached AS mean_ns,
        -- Also while a job waits for its thread, which earlier ones have.
        b.part IN ('callback', 'service') OR j.callback IS NOT NULL AS is_run,
        b.part IN (
            'network_or_idle', 'undecided', 'executor_busy', 'until_arrival', 'run_queue',
            'executor', 'take_to_callback'
        ) AS is_wait
    FROM breakdown AS b
    JOIN application_path AS a ON b.path = a.path
    LEFT JOIN (SELECT DISTINCT node, callback FROM callback_name WHERE is_job) AS j
        ON b.node = j.node AND b.what = j.callback
),
-- What takes requests on a path.
server AS (
    SELECT DISTINCT s.service_name, n.node, n.callback
    FROM main.service AS s
    JOIN main.callback AS c ON s.service_id = c.service_id
    JOIN callback_name AS n ON c.callback_id = n.callback_id
    WHERE list_contains($runs, s.run_id)
),
waiting AS (
    SELECT
        p.path, r.node, r.callback, r.topic_name,
        sum(p.mean_ns) AS mean_ns,
        max(p.p95_ns) AS p95_ns
    FROM piece AS p
    -- Not the waits of a service that is called in between.
    JOIN reader AS r
        ON p.path_id = r.path_id AND p.hop = r.hop
        AND (p.what = r.callback OR p.what = r.topic_name OR p.what IS NULL)
    -- A node that polls takes messages when it wants to.
    WHERE p.is_wait AND r.is_comparable AND NOT r.is_polled
    GROUP BY p.path, r.node, r.callback, r.topic_name
    UNION ALL
    SELECT
        p.path, s.node, s.callback, s.service_name,
        sum(p.mean_ns),
        max(p.p95_ns)
    FROM piece AS p
    JOIN server AS s ON p.node = s.node AND p.what = s.callback
    WHERE p.is_wait
    GROUP BY p.path, s.node, s.callback, s.service_name
),
failed AS (
    SELECT
        a.path, r.node, r.callback, r.topic_name,
        sum(d.dropped)::BIGINT AS lost,
        sum(d.dropped + d.lost + d.delivered)::BIGINT AS published,
        bool_and(s.queue_depth = 1) IS TRUE AS is_newest,
        any_value(a.age_ns - a.latency_ns) AS older_ns,
        any_value(a.length_ns) AS length_ns
    FROM (
        SELECT DISTINCT p.path, r.subscription_id, r.node, r.callback, r.topic_name, r.is_polled
        FROM reader AS r
        JOIN named_path AS p ON r.path_id = p.path_id
    ) AS r
    JOIN application_path AS a ON r.path = a.path
    JOIN delivery AS d ON r.subscription_id = d.subscription_id
    JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
    WHERE d.dropped > 0 AND NOT r.is_polled
    GROUP BY a.path, r.node, r.callback, r.topic_name
),
-- What is overwritten comes with the next message.
missed AS (
    SELECT
        path, node, callback, topic_name, lost, published,
        greatest(
            0,
            older_ns * lost / sum(lost) OVER (PARTITION BY path),
            CASE
                WHEN NOT is_newest
                    THEN length_ns / (published * greatest(published - lost, 1)) * lost
            END
        ) AS mean_ns
    FROM failed
),
late AS (
    SELECT
        coalesce(w.path, m.path) AS path,
        coalesce(w.node, m.node) AS node,
        coalesce(w.callback, m.callback) AS callback,
        coalesce(w.topic_name, m.topic_name) AS topic_name,
        w.p95_ns, m.lost, m.published,
        coalesce(w.mean_ns, 0) + coalesce(m.mean_ns, 0) AS mean_ns
    FROM waiting AS w
    FULL JOIN missed AS m
        ON w.path = m.path
        AND w.node IS NOT DISTINCT FROM m.node
        AND w.callback IS NOT DISTINCT FROM m.callback
        AND w.topic_name IS NOT DISTINCT FROM m.topic_name
)
SELECT
    p.path, p.node, u.callback,
    NULL AS waiting_node,
    NULL AS waiting_callback,
    false AS is_cpu,
    CASE WHEN u.callback IS NULL THEN p.what END AS topic_name,
    sum(p.mean_ns)::BIGINT AS mean_ns,
    max(p.p95_ns) AS p95_ns,
    NULL::BIGINT AS lost,
    NULL::BIGINT AS published
FROM piece AS p
LEFT JOIN callback_use AS u ON p.node = u.node AND p.what = u.callback
WHERE p.is_run
GROUP BY p.path, p.node, p.what, u.callback
UNION ALL
SELECT
    l.path,
    coalesce(w.other_node, h.node),
    coalesce(w.other_callback, h.callback),
    l.node, l.callback,
    coalesce(w.is_cpu, false),
    l.topic_name,
    (l.mean_ns * coalesce(w.share, 1))::BIGINT,
    coalesce(w.p95_ns, l.p95_ns),
    l.lost,
    l.published
FROM late AS l
LEFT JOIN callback_wait AS w ON l.node = w.node AND l.callback = w.callback
LEFT JOIN held_message AS h
    ON w.other_node IS NULL AND w.is_cpu IS NOT TRUE
    AND l.node = h.waiting_node AND l.topic_name = h.topic_name
