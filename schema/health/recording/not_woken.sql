-- title: Messages that wait until the next one comes
-- description: Nearly each message is taken right after the next one was published, and its
--     executor slept until then. Its latency is a period and the way of the next one.
-- cause: The executor was not woken: the middleware lost a notification once, and since then each
--     wakes it for the message before.
-- cure: Look whether the middleware or the executor has a newer version, and whether the delay goes
--     when the node is started again.
-- next: query topics --measure latency --topic {topic_name}
-- grain: one row per topic and node that takes it
-- severity: warning
-- when: store.executor_state
WITH message AS (
    SELECT
        l.run_id, l.subscription_id, t.thread_id, t.taken_ns, b.end_ns,
        lead(b.start_ns) OVER (PARTITION BY l.subscription_id ORDER BY b.start_ns) AS next_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN store.process AS p ON b.process_id = p.process_id
    JOIN store.process AS o ON t.process_id = o.process_id AND p.host_id = o.host_id
    WHERE l.run_id = $run_id
),
judged AS (
    SELECT
        m.*,
        w.state = 'wait'
        AND m.taken_ns - m.next_ns BETWEEN 0 AND 0.2 * (m.next_ns - m.end_ns)
        -- One that is on its way for a little longer than a period comes later, or at any time.
        AND m.taken_ns - m.next_ns <= 1_000_000 AS is_behind,
        min(m.taken_ns) FILTER (is_behind) OVER (PARTITION BY m.subscription_id) AS first_ns
    FROM message AS m
    ASOF JOIN (FROM store.executor_state WHERE run_id = $run_id) AS w
        ON m.thread_id = w.thread_id AND m.next_ns >= w.start_ns
)
SELECT
    j.run_id, s.process_id, s.node_id, s.topic_name,
    count(*) FILTER (j.is_behind) AS count,
    printf(
        '%d of %s since %.3f s were taken when the next one had come, %.3f ms late at the median',
        count(*) FILTER (j.is_behind), derive.counted(count(*), 'message'),
        (any_value(j.first_ns) - any_value(r.start_ns)) / 1e9,
        quantile_disc(j.next_ns - j.end_ns, 0.5) FILTER (j.is_behind) / 1e6
    ) AS detail
FROM judged AS j
JOIN store.subscription AS s ON j.subscription_id = s.subscription_id
JOIN store.run AS r ON j.run_id = r.run_id
WHERE j.taken_ns >= j.first_ns AND NOT s.is_internal
GROUP BY j.run_id, s.process_id, s.node_id, s.topic_name, j.subscription_id
HAVING count(*) FILTER (j.is_behind) >= greatest(10, 0.95 * count(*))
