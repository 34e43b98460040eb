-- description: Subscriptions at which flows end although their node publishes: at least three
--     messages came, and no callback of theirs led to anything, while timers, other messages or
--     what is outside of callbacks led to publications. If less than half of the callbacks did, to
--     what no other messages led, timers count that publish more. Either the node only consumes the
--     messages, or it keeps them: then a link has to be declared. That is not likely if the
--     messages descend from what the node publishes itself; if messages on another topic led to
--     publications before the first one came, or in shorter callbacks, as keeping takes less time
--     than using; or if what comes outside of callbacks neither answers them one by one, nor comes
--     from a thread that they started. Topics of ROS, topics that the node also publishes on,
--     inputs of annotations, and heartbeats (derive.heartbeat_topic) are left out.
-- grain: one row per such subscription, publisher of its node, and timer or subscription whose
--     callbacks published; one row for what it published outside of callbacks
-- param: runs
-- column: run_id
-- column: node_id BIGINT  Node
-- column: subscription_id BIGINT  Subscription at which flows end
-- column: topic_name VARCHAR  Its topic
-- column: message_count BIGINT  Messages that it got
-- column: leading_count BIGINT  Those of them that led on directly
-- column: publisher_id BIGINT  Publisher of the node
-- column: output_topic VARCHAR  Its topic
-- column: timer_id BIGINT  Timer whose callbacks published; NULL: none
-- column: trigger_id BIGINT  Subscription whose callbacks published; NULL: none
-- column: cause VARCHAR  What led to publications, in words: 'by a timer of 50 ms', 'from /points',
--     'outside of callbacks'
-- column: publication_count BIGINT  Messages that were published so
-- column: early_count BIGINT  Those before the first message of the subscription
-- column: run_ns BIGINT [ns]  Median run of the callbacks of the subscription
-- column: publishing_run_ns BIGINT [ns]  Median run of the callbacks that published
-- column: is_loop BOOLEAN  The messages descend from what the node publishes
-- column: is_queue BOOLEAN  Outside of callbacks as much was published as messages came, each after
--     the message of its number
-- column: is_pool BOOLEAN  Several threads did: one may have overtaken another
-- column: is_likely BOOLEAN  Nothing speaks against a link
CREATE OR REPLACE MACRO main.dead_end(runs) AS TABLE
-- Logging is no effect.
WITH RECURSIVE caused AS NOT MATERIALIZED (
    SELECT
        l.kind, l.callback_instance_id, l.take_id, l.subscription_id, l.publication_id,
        l.publisher_id, p.node_id, p.topic_name,
        -- What a job publishes again (derive.job_again).
        (l.kind = 'direct' AND l.candidate_count > 1 AND NOT o.is_ambiguous) IS TRUE AS is_again
    FROM store.link_causal AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    JOIN store.process AS o ON p.process_id = o.process_id
    WHERE list_contains(runs, l.run_id) AND NOT p.is_internal
),
instance AS MATERIALIZED (
    SELECT
        d.run_id, d.node_id, d.subscription_id, i.callback_instance_id, i.start_ns,
        i.end_ns - i.start_ns AS run_ns
    FROM derive.unanswered_subscription AS d
    JOIN store.callback AS c ON d.subscription_id = c.subscription_id
    JOIN store.callback_instance AS i ON c.callback_id = i.callback_id
    WHERE list_contains(runs, d.run_id) AND list_contains(runs, i.run_id)
),
effective AS (
    SELECT callback_instance_id FROM caused WHERE NOT is_again
    UNION
    SELECT callback_instance_id FROM store.link_request WHERE list_contains(runs, run_id)
    UNION
    SELECT callback_instance_id FROM store.link_response WHERE list_contains(runs, run_id)
),
idle AS MATERIALIZED (
    SELECT
        i.run_id, i.node_id, i.subscription_id,
        count(*) AS message_count,
        count(e.callback_instance_id) AS leading_count,
        min(i.start_ns) AS first_ns,
        quantile_disc(i.run_ns, 0.5) AS run_ns
    FROM instance AS i
    LEFT JOIN effective AS e ON i.callback_instance_id = e.callback_instance_id
    GROUP BY i.run_id, i.node_id, i.subscription_id
    HAVING count(*) >= 3 AND 2 * leading_count < message_count
),
published AS MATERIALIZED (
    SELECT
        l.node_id, l.publisher_id, c.timer_id,
        c.subscription_id AS trigger_id,
        b.start_ns, b.thread_id,
        i.end_ns - i.start_ns AS run_ns
    FROM caused AS l
    SEMI JOIN idle AS d ON l.node_id = d.node_id
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.timer AS t ON c.timer_id = t.timer_id
    LEFT JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
    WHERE l.kind = 'direct' AND l.topic_name IS NOT NULL AND NOT l.is_again
        AND l.node_id = coalesce(t.node_id, s.node_id)
    UNION ALL
    SELECT p.node_id, b.publisher_id, NULL, NULL, b.start_ns, b.thread_id, NULL
    FROM store.publication AS b
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    SEMI JOIN idle AS d ON p.node_id = d.node_id
    ANTI JOIN (FROM caused WHERE NOT is_again) AS l ON b.publication_id = l.publication_id
    WHERE list_contains(runs, b.run_id) AND NOT p.is_internal AND p.topic_name IS NOT NULL
),
every_output AS MATERIALIZED (
    SELECT
        d.run_id, d.node_id, d.subscription_id, d.message_count, d.leading_count, d.run_ns,
        p.publisher_id, p.timer_id, p.trigger_id,
        count(*) AS publication_count,
        count(*) FILTER (WHERE p.start_ns < d.first_ns) AS early_count,
        quantile_disc(p.run_ns, 0.5) AS publishing_run_ns
    FROM idle AS d
    JOIN published AS p ON d.node_id = p.node_id
    WHERE d.leading_count = 0
        -- A node that passes on little may filter, and publish a state that no subscription takes.
        OR p.timer_id IS NOT NULL AND EXISTS (
            FROM store.publisher AS b
            JOIN store.subscription AS s ON b.run_id = s.run_id AND b.topic_name = s.topic_name
            WHERE b.publisher_id = p.publisher_id
        ) AND NOT EXISTS (
            FROM (SELECT DISTINCT publisher_id, trigger_id FROM published) AS o
            JOIN (SELECT DISTINCT publisher_id, trigger_id FROM published) AS j
                ON o.publisher_id = j.publisher_id
            WHERE o.trigger_id = d.subscription_id AND j.trigger_id <> d.subscription_id
        )
    GROUP BY ALL
    HAVING count(*) > d.leading_count
),
output AS (
    FROM every_output
    WHERE publisher_id NOT IN (
        SELECT p.publisher_id
        FROM derive.heartbeat_topic(runs) AS h
        JOIN store.publisher AS p ON h.run_id = p.run_id AND h.topic_name = p.topic_name
    )
),
-- One after the other, and few that wait at the end.
queue AS (
    SELECT
        m.subscription_id, b.publisher_id,
        count(DISTINCT b.thread_id) > 1 AS is_pool
    FROM (
        SELECT
            node_id, subscription_id, start_ns,
            row_number() OVER (PARTITION BY subscription_id ORDER BY start_ns) AS number,
            count(*) OVER (PARTITION BY subscription_id) AS number_of_all
        FROM instance
    ) AS m
    JOIN (
        SELECT
            node_id, publisher_id, thread_id, start_ns,
            row_number() OVER (PARTITION BY publisher_id ORDER BY start_ns) AS number,
            count(*) OVER (PARTITION BY publisher_id) AS number_of_all
        FROM published
        WHERE timer_id IS NULL AND trigger_id IS NULL
    ) AS b
        ON m.node_id = b.node_id AND m.number = b.number
    GROUP BY m.subscription_id, b.publisher_id
    HAVING bool_and(b.start_ns >= m.start_ns)
        AND count(*) = any_value(b.number_of_all)
        AND count(*) >= greatest(0.9 * any_value(m.number_of_all), any_value(m.number_of_all) - 10)
),
descent (node_id, subscription_id) AS (
    SELECT o.node_id, h.subscription_id
    FROM output AS o
    JOIN store.flow_hop AS h ON o.publisher_id = h.publisher_id
    UNION
    SELECT d.node_id, h.subscription_id
    FROM descent AS d
    JOIN store.flow_hop AS h ON d.subscription_id = h.from_subscription_id
),
open AS MATERIALIZED (
    FROM output AS o
    ANTI JOIN descent AS d ON o.node_id = d.node_id AND o.subscription_id = d.subscription_id
),
-- Links that may be missing would lead on, too: of those that would form a ring none is likely.
onward AS MATERIALIZED (
    SELECT from_subscription_id, publisher_id, subscription_id
    FROM store.flow_hop
    WHERE list_contains(runs, run_id)
    UNION
    SELECT o.subscription_id, h.publisher_id, h.subscription_id
    FROM open AS o
    JOIN store.flow_hop AS h ON o.publisher_id = h.publisher_id
),
supposed_descent (node_id, subscription_id) AS (
    SELECT o.node_id, h.subscription_id
    FROM open AS o
    JOIN onward AS h ON o.publisher_id = h.publisher_id
    UNION
    SELECT d.node_id, h.subscription_id
    FROM supposed_descent AS d
    JOIN onward AS h ON d.subscription_id = h.from_subscription_id
),
loop AS (
    FROM descent
    UNION
    FROM supposed_descent
)
SELECT
    o.run_id, o.node_id, o.subscription_id, s.topic_name, o.message_count, o.leading_count,
    o.publisher_id,
    p.topic_name AS output_topic,
    o.timer_id, o.trigger_id,
    CASE
        WHEN o.trigger_id IS NOT NULL THEN 'from ' || coalesce(g.topic_name, '?')
        WHEN o.timer_id IS NULL THEN 'outside of callbacks'
        ELSE coalesce(printf('by a timer of %.10g ms', t.period_ns / 1e6), 'by a timer')
    END AS cause,
    o.publication_count, o.early_count, o.run_ns, o.publishing_run_ns,
    l.subscription_id IS NOT NULL AS is_loop,
    q.subscription_id IS NOT NULL AS is_queue,
    coalesce(q.is_pool, false) AS is_pool,
    l.subscription_id IS NULL
    AND (
        o.timer_id IS NOT NULL
        OR q.subscription_id IS NOT NULL
        OR (o.subscription_id, o.publisher_id) IN (
            SELECT (subscription_id, publisher_id) FROM caused WHERE is_again
        )
        OR o.trigger_id IS NOT NULL
        AND o.early_count = 0 AND coalesce(o.run_ns <= o.publishing_run_ns, true)
    ) AS is_likely
FROM output AS o
JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
JOIN store.publisher AS p ON o.publisher_id = p.publisher_id
LEFT JOIN store.timer AS t ON o.timer_id = t.timer_id
LEFT JOIN store.subscription AS g ON o.trigger_id = g.subscription_id
LEFT JOIN queue AS q
    ON o.subscription_id = q.subscription_id
    AND o.publisher_id = q.publisher_id
    AND coalesce(o.timer_id, o.trigger_id) IS NULL
LEFT JOIN loop AS l ON o.node_id = l.node_id AND o.subscription_id = l.subscription_id
