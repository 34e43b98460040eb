-- description: Publications that followed a take without a callback, and may be due to something
--     else that their node took. An executor of rclpy takes from all that is ready before it goes
--     on with what waits for a response, and other threads may take meanwhile. So if a response was
--     taken since the take before of the subscription, either may be the cause. A node that
--     executes goals publishes for these, at any time; where calls have no events, so may one that
--     sends goals. But what is published once after each message of one subscription, and never
--     else, is for these: the recording may end before the last. Executors of rclcpp run what a
--     take leads to right behind it.
-- grain: one row per such publication
-- param: links VARCHAR  Name of the rows of derive.link_causal_take_adjacent
CREATE OR REPLACE MACRO derive.answer_to_call(only_run, links) AS TABLE
WITH taken AS (
    SELECT
        take_id, subscription_id,
        lag(taken_ns) OVER (PARTITION BY subscription_id ORDER BY start_event_id) AS before_ns,
        count(*) OVER (PARTITION BY subscription_id) AS number
    FROM store.take
    WHERE run_id = only_run
        AND subscription_id IN (SELECT subscription_id FROM query_table(links))
),
answering AS (
    SELECT l.publisher_id
    FROM query_table(links) AS l
    JOIN taken AS t ON l.take_id = t.take_id
    GROUP BY l.publisher_id
    HAVING count(DISTINCT l.take_id) >= greatest(5, any_value(t.number) - 1)
        AND count(DISTINCT l.subscription_id) = 1
        AND count(DISTINCT l.take_id) = (
            SELECT count(*)
            FROM store.publication AS b
            WHERE b.publisher_id = l.publisher_id
        )
),
follower AS MATERIALIZED (
    SELECT
        l.publication_id, l.start_ns,
        coalesce(p.node_id, -p.process_id) AS owner_id,
        coalesce(t.before_ns, 0) AS since_ns
    FROM query_table(links) AS l
    JOIN taken AS t ON l.take_id = t.take_id
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    ANTI JOIN answering AS a ON l.publisher_id = a.publisher_id
    ANTI JOIN (FROM derive.thread_turn WHERE run_id = only_run) AS x ON l.thread_id = x.thread_id
)
SELECT f.publication_id
FROM follower AS f
ASOF JOIN (
    SELECT
        coalesce(c.node_id, -c.process_id) AS owner_id,
        r.taken_ns
    FROM store.response AS r
    JOIN store.client AS c ON r.client_id = c.client_id
) AS r ON f.owner_id = r.owner_id AND f.start_ns > r.taken_ns
WHERE r.taken_ns > f.since_ns
UNION
SELECT f.publication_id
FROM follower AS f
JOIN derive.action_endpoint AS e ON f.owner_id = coalesce(e.node_id, -e.process_id)
LEFT JOIN store.request AS q ON e.kind = 'service' AND e.object_id = q.service_id
WHERE e.part = 'send_goal'
    AND (q.taken_ns < f.start_ns OR e.process_id NOT IN (FROM derive.call_traced))
