-- description: The paths that e2e-latency and path-breakdown show, with the objects on them.
-- grain: one row per printed path
-- column: path_id BIGINT  Number of the path
-- column: path VARCHAR  Nodes and topics
-- column: topics
-- column: publishers BIGINT[]  All publishers on it
-- column: subscriptions BIGINT[]  All subscriptions on it
-- column: is_cut BOOLEAN  The path goes on or has siblings beyond the limits of the search
-- column: is_comparable BOOLEAN  The clocks of all its hosts were brought together, or are one
WITH path AS MATERIALIZED (
    SELECT
        alike_id AS path_id,
        path,
        any_value(topics) AS topics,
        list_sort(list_distinct(flatten(list(publishers)))) AS publishers,
        list_sort(list_distinct(flatten(list(subscriptions)))) AS subscriptions,
        bool_or(is_cut) AS is_cut
    FROM main.flow_path([$run], only_paths := true)
    GROUP BY alike_id, path
),
visited AS (
    SELECT v.path_id, b.process_id
    FROM (
        SELECT
            path_id,
            unnest(publishers) AS publisher_id
        FROM path
    ) AS v
    JOIN main.publisher AS b ON v.publisher_id = b.publisher_id
    UNION
    SELECT v.path_id, s.process_id
    FROM (
        SELECT
            path_id,
            unnest(subscriptions) AS subscription_id
        FROM path
    ) AS v
    JOIN main.subscription AS s ON v.subscription_id = s.subscription_id
),
timed AS (
    SELECT
        v.path_id,
        -- A clock that none was corrected to, and that was not corrected itself, stands alone.
        count(DISTINCT coalesce(c.reference_clock_id, -c.clock_id)) = 1 AS is_comparable
    FROM visited AS v
    JOIN main.process AS p ON v.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    JOIN main.clock AS c ON h.clock_id = c.clock_id
    GROUP BY v.path_id
)
SELECT
    a.path_id, a.path, a.topics, a.publishers, a.subscriptions, a.is_cut,
    coalesce(t.is_comparable, true) AS is_comparable
FROM path AS a
LEFT JOIN timed AS t ON a.path_id = t.path_id
ORDER BY a.path
