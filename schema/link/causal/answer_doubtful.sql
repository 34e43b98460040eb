-- description: Publications that followed a take without a callback, and may have another cause
--     than its message. In rclpy a timer shows no event. What it publishes follows some message,
--     too, and so does what a loop publishes by a clock of its own. So a publisher is doubtful if a
--     timer explains it (derive.timed_publisher), if its intervals are steadier than its delay
--     after the takes, if it publishes more often after some messages than after others, or if it
--     keeps its interval while the number of messages in between differs. Intervals with a gap do
--     not count if five others are left. Fewer than five messages prove nothing: then it is
--     doubtful if its process has timers, or if it or a subscription is older than the recording,
--     since a timer may then be older as well. Of a publisher that answers, what it publishes
--     beyond the usual number per message is doubtful. So is what one node publishes after a
--     message to another; of a publisher that does so more than now and then, all is.
-- grain: one row per publication that is not surely an answer
-- param: links VARCHAR  Name of the rows of derive.link_causal_take_adjacent
CREATE OR REPLACE MACRO derive.answer_doubtful(only_run, links) AS TABLE
WITH message AS (
    SELECT
        l.publisher_id, t.start_event_id,
        row_number() OVER (PARTITION BY l.publisher_id ORDER BY t.start_event_id) AS number
    FROM (SELECT DISTINCT publisher_id, subscription_id FROM query_table(links)) AS l
    JOIN store.take AS t ON l.subscription_id = t.subscription_id
    WHERE t.run_id = only_run
),
own AS MATERIALIZED (
    SELECT
        b.publication_id, b.publisher_id, b.trace_id, b.start_ns,
        b.start_ns - lag(b.start_ns) OVER earlier AS interval_ns,
        m.number - lag(m.number) OVER earlier AS message_count
    FROM store.publication AS b
    SEMI JOIN query_table(links) AS l ON b.publisher_id = l.publisher_id
    ASOF LEFT JOIN message AS m
        ON b.publisher_id = m.publisher_id AND b.start_event_id > m.start_event_id
    WHERE b.run_id = only_run
    WINDOW earlier AS (PARTITION BY b.publisher_id ORDER BY b.start_event_id)
),
since AS MATERIALIZED (
    SELECT
        publication_id,
        NULL::BIGINT AS take_id,
        trace_id, start_ns,
        start_ns - interval_ns AS taken_ns
    FROM own
),
-- What was published in a gap is missing. Where that leaves fewer than five intervals, all count.
counted AS (
    SELECT o.publisher_id, o.interval_ns, o.message_count
    FROM own AS o
    LEFT JOIN derive.take_behind_gap('since') AS g ON o.publication_id = g.publication_id
    QUALIFY g.publication_id IS NULL
        OR count(CASE WHEN g.publication_id IS NULL THEN o.interval_ns END)
            OVER (PARTITION BY o.publisher_id) < 5
),
-- Waits and long callbacks disturb some publications, so only the middle four fifths count. A loop
-- in a busy thread keeps its interval in the middle half: it differs by less than half, so
-- bursts do not count. A node that leaves out some messages answers each of that half.
rhythm AS MATERIALIZED (
    SELECT
        publisher_id,
        avg(interval_ns) AS mean_ns,
        quantile_disc(interval_ns, 0.9) - quantile_disc(interval_ns, 0.1) AS spread_ns,
        quantile_disc(interval_ns, 0.25)
            > greatest(0.5 * mean_ns, quantile_disc(interval_ns, 0.75) - 0.45 * mean_ns)
        AND quantile_disc(message_count, 0.1) < quantile_disc(message_count, 0.9)
        AND quantile_disc(message_count, [0.25, 0.75]) <> [1, 1] AS has_own_clock
    FROM counted
    GROUP BY publisher_id
),
-- What a callback publishes in a burst counts once: each within a tenth of the usual interval.
follower AS MATERIALIZED (
    SELECT
        l.subscription_id, l.publisher_id, l.take_id, l.publication_id, l.start_event_id,
        l.start_ns,
        l.start_ns - l.taken_ns AS delay_ns,
        n.taken_ns - l.start_ns AS rest_ns,
        o.interval_ns, o.message_count,
        CASE WHEN o.interval_ns < least(l.start_ns - l.taken_ns, r.mean_ns / 10) THEN 0 ELSE 1 END
            AS number,
        p.process_id,
        p.created_ns IS NULL OR s.created_ns IS NULL AS is_old,
        coalesce(p.node_id <> s.node_id, false) AS is_between_nodes
    FROM query_table(links) AS l
    JOIN own AS o ON l.publication_id = o.publication_id
    JOIN rhythm AS r ON l.publisher_id = r.publisher_id
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    LEFT JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
    ASOF LEFT JOIN (
        SELECT t.thread_id, t.start_event_id, t.taken_ns
        FROM store.take AS t
        SEMI JOIN query_table(links) AS l ON t.thread_id = l.thread_id
        WHERE t.run_id = only_run
    ) AS n ON l.thread_id = n.thread_id AND l.start_event_id < n.start_event_id
),
usual AS (
    SELECT
        subscription_id, publisher_id,
        quantile_disc(number, 0.5) AS usual_number,
        count(*) >= 5 AND quantile_disc(number, 0.1) < quantile_disc(number, 0.9) AS differs
    FROM (
        SELECT
            subscription_id, publisher_id,
            sum(number) AS number
        FROM follower
        GROUP BY subscription_id, publisher_id, take_id
    )
    GROUP BY subscription_id, publisher_id
),
doubtful AS (
    SELECT f.publisher_id
    FROM follower AS f
    JOIN rhythm AS r ON f.publisher_id = r.publisher_id
    GROUP BY f.publisher_id, f.process_id, r.spread_ns, r.has_own_clock
    HAVING count_if(f.is_between_nodes) > 0.1 * count(*) OR CASE
        WHEN count(DISTINCT f.take_id) < 5
            THEN bool_or(f.is_old)
                OR f.process_id IN (SELECT process_id FROM store.timer WHERE run_id = only_run)
        ELSE r.has_own_clock
            OR r.spread_ns
                < 0.8 * (quantile_disc(f.delay_ns, 0.9) - quantile_disc(f.delay_ns, 0.1))
    END
    UNION
    FROM derive.timed_publisher(only_run, 'follower')
    UNION
    SELECT publisher_id FROM usual WHERE differs
)
SELECT f.publication_id
FROM follower AS f
JOIN usual AS u
    ON f.subscription_id IS NOT DISTINCT FROM u.subscription_id AND f.publisher_id = u.publisher_id
QUALIFY f.is_between_nodes
    OR f.publisher_id IN (FROM doubtful)
    OR sum(f.number) OVER (
        PARTITION BY f.take_id, f.publisher_id
        ORDER BY f.start_event_id ROWS UNBOUNDED PRECEDING
    ) > u.usual_number
