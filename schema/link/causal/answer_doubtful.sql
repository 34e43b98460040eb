-- name: derive.answer_doubtful
-- kind: macro
-- description: Publications that followed a take without a callback, and may have another cause
--     than its message. In rclpy a timer shows no event, and what it publishes follows some
--     message, too. An answer comes once per message, and soon. So it is doubtful that a publisher
--     answers the messages of a subscription if a timer explains the publisher
--     (derive.timed_publisher), if its own intervals are steadier than its delay after the takes,
--     or if the number of publications per message differs. Intervals with a gap do not count if
--     five others are left. Only messages after which the publisher published count. Fewer than
--     five prove nothing: then the publisher is doubtful if it or the subscription is older than
--     the recording, since a timer may then be older than the recording as well. If the publisher
--     answers, what it publishes beyond the usual number per message is doubtful.
-- grain: one row per publication that is not surely an answer
-- param: only_run BIGINT  Run to look at
-- param: links VARCHAR  Name of the rows of derive.link_causal_take_adjacent

-- Waits and long callbacks disturb some publications, so only the middle four fifths count. Of
-- fewer than five messages the middle four fifths are all of them, and prove nothing.
CREATE OR REPLACE MACRO derive.answer_doubtful(only_run, links) AS TABLE
WITH own AS MATERIALIZED (
    SELECT
        b.publication_id, b.publisher_id, b.trace_id, b.start_ns,
        b.start_ns - lag(b.start_ns) OVER (
            PARTITION BY b.publisher_id ORDER BY b.start_event_id
        ) AS interval_ns
    FROM store.publication AS b
    SEMI JOIN query_table(links) AS l ON b.publisher_id = l.publisher_id
    WHERE b.run_id = only_run
),
since AS MATERIALIZED (
    SELECT
        publication_id, NULL::BIGINT AS take_id, trace_id, start_ns,
        start_ns - interval_ns AS taken_ns
    FROM own
),
-- What was published in a gap is missing. Where that leaves fewer than five intervals, all count.
rhythm AS MATERIALIZED (
    SELECT
        o.publisher_id,
        avg(o.interval_ns) AS mean_ns,
        CASE
            WHEN count(CASE WHEN g.publication_id IS NULL THEN o.interval_ns END) < 5
                THEN quantile_disc(o.interval_ns, 0.9) - quantile_disc(o.interval_ns, 0.1)
            ELSE
                quantile_disc(o.interval_ns, 0.9) FILTER (g.publication_id IS NULL)
                - quantile_disc(o.interval_ns, 0.1) FILTER (g.publication_id IS NULL)
        END AS spread_ns
    FROM own AS o
    LEFT JOIN derive.take_behind_gap('since') AS g ON o.publication_id = g.publication_id
    GROUP BY o.publisher_id
),
next_take AS (
    SELECT t.thread_id, t.start_event_id, t.taken_ns
    FROM store.take AS t
    SEMI JOIN query_table(links) AS l ON t.thread_id = l.thread_id
    WHERE t.run_id = only_run
),
-- What a callback publishes in a burst counts once: each within a tenth of the usual interval.
follower AS MATERIALIZED (
    SELECT
        l.subscription_id, l.publisher_id, l.take_id, l.publication_id, l.start_event_id,
        l.start_ns,
        l.start_ns - l.taken_ns AS delay_ns,
        n.taken_ns - l.start_ns AS rest_ns,
        CASE WHEN o.interval_ns < least(l.start_ns - l.taken_ns, r.mean_ns / 10) THEN 0 ELSE 1 END
            AS number
    FROM query_table(links) AS l
    JOIN own AS o ON l.publication_id = o.publication_id
    JOIN rhythm AS r ON l.publisher_id = r.publisher_id
    ASOF LEFT JOIN next_take AS n
        ON l.thread_id = n.thread_id AND l.start_event_id < n.start_event_id
),
answered AS MATERIALIZED (
    SELECT
        subscription_id, publisher_id, take_id,
        min(delay_ns) AS delay_ns,
        sum(number) AS number
    FROM follower
    GROUP BY subscription_id, publisher_id, take_id
),
pair AS (
    SELECT
        subscription_id, publisher_id,
        count(*) AS take_count,
        quantile_disc(delay_ns, 0.9) - quantile_disc(delay_ns, 0.1) AS spread_ns,
        quantile_disc(number, 0.1) AS least_number,
        quantile_disc(number, 0.5) AS usual_number,
        quantile_disc(number, 0.9) AS most_number
    FROM answered
    GROUP BY subscription_id, publisher_id
),
judged AS MATERIALIZED (
    SELECT
        a.subscription_id, a.publisher_id, a.usual_number,
        a.publisher_id IN (FROM derive.timed_publisher(only_run, 'follower'))
        OR CASE
            WHEN a.take_count < 5 THEN p.created_ns IS NULL OR s.created_ns IS NULL
            ELSE r.spread_ns < 0.8 * a.spread_ns OR a.least_number < a.most_number
        END AS is_doubtful
    FROM pair AS a
    JOIN rhythm AS r ON a.publisher_id = r.publisher_id
    JOIN store.publisher AS p ON a.publisher_id = p.publisher_id
    LEFT JOIN store.subscription AS s ON a.subscription_id = s.subscription_id
)
SELECT f.publication_id
FROM follower AS f
JOIN judged AS j
    ON f.subscription_id IS NOT DISTINCT FROM j.subscription_id
    AND f.publisher_id = j.publisher_id
QUALIFY j.is_doubtful
    OR sum(f.number) OVER (
        PARTITION BY f.take_id, f.publisher_id
        ORDER BY f.start_event_id ROWS UNBOUNDED PRECEDING
    ) > j.usual_number
