-- name: main.dead_end
-- kind: macro
-- description: Subscriptions at which flows end although their node publishes: at least three
--     messages came, and none of their callbacks led to anything, while timers of the node or other
--     messages led to publications. Either the node only consumes these messages, or it keeps them,
--     and what it publishes depends on them: then a link has to be declared. A link is not
--     likely if the messages descend from what the node publishes itself, and end a loop. Nor is it
--     if messages on another topic led to publications before the first one came, or in callbacks
--     that run shorter: to keep a message takes less time than to use it. Topics of ROS itself,
--     topics that the node also publishes on, and inputs of annotations are left out.
-- grain: one row per such subscription, publisher of its node, and timer or subscription whose
--     callbacks published
-- param: runs BIGINT[]  Runs to look at
-- column: run_id BIGINT  Run
-- column: node_id BIGINT  Node
-- column: subscription_id BIGINT  Subscription at which flows end
-- column: topic_name VARCHAR  Its topic
-- column: message_count BIGINT  Messages that it got
-- column: publisher_id BIGINT  Publisher of the node
-- column: output_topic VARCHAR  Its topic
-- column: timer_id BIGINT  Timer whose callbacks published; NULL: a subscription
-- column: trigger_id BIGINT  Subscription whose callbacks published; NULL: a timer
-- column: cause VARCHAR  What led to publications, in words: 'by a timer of 50 ms', 'from /points'
-- column: publication_count BIGINT  Messages that these callbacks published
-- column: early_count BIGINT  Those before the first message of the subscription
-- column: run_ns BIGINT [ns]  Median run of the callbacks of the subscription
-- column: publishing_run_ns BIGINT [ns]  Median run of the callbacks that published
-- column: is_loop BOOLEAN  The messages descend from what the node publishes
-- column: is_likely BOOLEAN  Nothing speaks against a link
CREATE OR REPLACE MACRO main.dead_end(runs) AS TABLE
-- Logging is no effect.
WITH RECURSIVE caused AS NOT MATERIALIZED (
    SELECT
        l.kind, l.callback_instance_id, l.take_id, l.subscription_id, l.publication_id,
        l.publisher_id, p.node_id, p.topic_name
    FROM store.link_causal AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
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
-- What led to something, but for known takes: derive.unanswered_subscription leaves those out.
effective AS (
    SELECT callback_instance_id FROM caused WHERE take_id IS NULL
    UNION ALL
    SELECT callback_instance_id FROM store.link_request WHERE list_contains(runs, run_id)
    UNION ALL
    SELECT callback_instance_id FROM store.link_response WHERE list_contains(runs, run_id)
),
idle AS MATERIALIZED (
    SELECT
        i.run_id, i.node_id, i.subscription_id,
        count(*) AS message_count,
        min(i.start_ns) AS first_ns,
        quantile_disc(i.run_ns, 0.5) AS run_ns
    FROM instance AS i
    LEFT JOIN effective AS e ON i.callback_instance_id = e.callback_instance_id
    GROUP BY i.run_id, i.node_id, i.subscription_id
    HAVING count(*) >= 3 AND count(e.callback_instance_id) = 0
),
published AS MATERIALIZED (
    SELECT
        l.node_id, l.publisher_id, c.timer_id, c.subscription_id AS trigger_id, b.start_ns,
        i.end_ns - i.start_ns AS run_ns
    FROM caused AS l
    SEMI JOIN idle AS d ON l.node_id = d.node_id
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.timer AS t ON c.timer_id = t.timer_id
    LEFT JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
    WHERE l.kind = 'direct' AND l.topic_name IS NOT NULL
        AND l.node_id = coalesce(t.node_id, s.node_id)
),
output AS (
    SELECT
        d.run_id, d.node_id, d.subscription_id, d.message_count, d.run_ns, p.publisher_id,
        p.timer_id, p.trigger_id,
        count(*) AS publication_count,
        count(*) FILTER (WHERE p.start_ns < d.first_ns) AS early_count,
        quantile_disc(p.run_ns, 0.5) AS publishing_run_ns
    FROM idle AS d
    JOIN published AS p ON d.node_id = p.node_id
    GROUP BY ALL
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
    SELECT o.node_id, o.subscription_id, o.publisher_id
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
    SELECT node_id, subscription_id FROM descent
    UNION
    SELECT node_id, subscription_id FROM supposed_descent
)
SELECT
    o.run_id,
    o.node_id,
    o.subscription_id,
    s.topic_name,
    o.message_count,
    o.publisher_id,
    p.topic_name AS output_topic,
    o.timer_id,
    o.trigger_id,
    CASE
        WHEN o.timer_id IS NULL THEN 'from ' || coalesce(g.topic_name, '?')
        ELSE coalesce(printf('by a timer of %.10g ms', t.period_ns / 1e6), 'by a timer')
    END AS cause,
    o.publication_count,
    o.early_count,
    o.run_ns,
    o.publishing_run_ns,
    l.subscription_id IS NOT NULL AS is_loop,
    l.subscription_id IS NULL
    AND (
        o.timer_id IS NOT NULL
        OR o.early_count = 0 AND coalesce(o.run_ns <= o.publishing_run_ns, true)
    ) AS is_likely
FROM output AS o
JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
JOIN store.publisher AS p ON o.publisher_id = p.publisher_id
LEFT JOIN store.timer AS t ON o.timer_id = t.timer_id
LEFT JOIN store.subscription AS g ON o.trigger_id = g.subscription_id
LEFT JOIN loop AS l ON o.node_id = l.node_id AND o.subscription_id = l.subscription_id
